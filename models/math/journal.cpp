#include "models/math/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "models/math/error.h"
#include "models/math/sha256.h"

namespace sparflow {
namespace {

/// What a journal begins with; the SHA-256 of its run follows.
constexpr char kFirst[] = R"({"journal":1,"run":")";

std::string hex_of(const std::string& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * bytes.size());
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    hex += kDigits[byte / 16U];
    hex += kDigits[byte % 16U];
  }
  return hex;
}

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/// @return whether `hex` is hexadecimal
bool bytes_of(const std::string& hex, std::string& bytes) {
  if (hex.size() % 2 != 0) return false;
  bytes.clear();
  bytes.reserve(hex.size() / 2);
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    const int high = digit_of(hex[i]), low = digit_of(hex[i + 1]);
    if (high < 0 || low < 0) return false;
    bytes += static_cast<char>(16 * high + low);
  }
  return true;
}

/// A part is known by its name, too, so that a damaged name is noticed.
std::string sum_of(const std::string& part, const std::string& bytes) {
  return sha256_hex(part + '\n' + bytes);
}

/// The string at a key, or "" where the line has none.
std::string string_at(const nlohmann::json& line, const char* key) {
  const auto found = line.is_object() ? line.find(key) : line.end();
  return line.is_object() && found != line.end() && found->is_string() ? found->get<std::string>()
                                                                       : std::string();
}

[[noreturn]] void journal_fails(const std::string& path, int reason) {
  throw InputError({path, 0, 0}, "",
                   fmt::format("the journal cannot be written: {}", std::strerror(reason)));
}

/// @return 0, or the error
int append_whole(int fd, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    done += static_cast<std::size_t>(n);
  }
  // File systems that cannot flush are none the worse.
  return ::fsync(fd) == 0 || errno == EINVAL ? 0 : errno;
}

/// So that a new journal is found after a loss of power.
void flush_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

Journal::Journal(std::string path, std::string run, bool resume)
    : path_(std::move(path)), run_(std::move(run)), resume_(resume) {
  // The file is locked before it is read, so that no other run adds to it in between.
  if (resume_ && ::access(path_.c_str(), F_OK) == 0) {
    lock();
    try {
      read();
    } catch (...) {
      ::close(fd_);  // no destructor runs for an object that was never complete
      throw;
    }
  }
}

Journal::~Journal() {
  if (fd_ >= 0) ::close(fd_);
}

void Journal::read() {
  std::ifstream in(path_, std::ios::binary);
  if (!in) throw InputError({path_, 0, 0}, "", "cannot read this journal");
  std::ostringstream all;
  all << in.rdbuf();
  const std::string text = all.str();
  int number = 0;
  std::size_t at = 0;
  for (std::size_t end; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    read_line(text.substr(at, end - at), ++number);
  }
  whole_ = static_cast<long>(at);
  if (at < text.size()) {
    warnings_.push_back(
        fmt::format("{}:{}: the last line was not written to its end; its part is computed again",
                    path_, number + 1));
  }
}

void Journal::read_line(const std::string& line, int number) {
  const nlohmann::json parsed = nlohmann::json::parse(line, nullptr, false);
  if (number == 1) {
    const std::string run = string_at(parsed, "run");
    if (run.empty() || !parsed.contains("journal")) {
      throw InputError({path_, 1, 0}, "",
                       "this is no journal of finished parts, or its first line is damaged; "
                       "delete it, or run without --resume");
    }
    if (run != run_) {
      throw InputError({path_, 1, 0}, "run",
                       "this journal belongs to a run with other inputs or options, or of another "
                       "build of the program; repeat that run, or run without --resume");
    }
    return;
  }
  const std::string part = string_at(parsed, "part");
  std::string bytes;
  if (part.empty() || !bytes_of(string_at(parsed, "hex"), bytes) ||
      string_at(parsed, "sha256") != sum_of(part, bytes)) {
    warnings_.push_back(
        fmt::format("{}:{}: the line is damaged; its part is computed again", path_, number));
    return;
  }
  parts_[part] = std::move(bytes);
}

const std::string* Journal::find(const std::string& part) const {
  const auto found = parts_.find(part);
  return found == parts_.end() ? nullptr : &found->second;
}

void Journal::lock() {
  fd_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (fd_ < 0) journal_fails(path_, errno);
  int failed = 0;
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    failed = errno;
    ::close(std::exchange(fd_, -1));
    if (failed != EWOULDBLOCK) journal_fails(path_, failed);
    throw InputError({path_, 0, 0}, "", "another run is writing this journal");
  }
}

void Journal::begin() {
  if (fd_ < 0) lock();
  std::string before(std::strlen(kFirst), '\0');
  std::ifstream(path_, std::ios::binary)
      .read(before.data(), static_cast<std::streamsize>(before.size()));
  const std::size_t common = std::min(before.find('\0'), before.size());
  if (before.compare(0, common, kFirst, common) != 0) {
    ::close(std::exchange(fd_, -1));
    throw InputError({path_, 0, 0}, "",
                     "this is no journal of finished parts, and is not replaced");
  }
  // Without --resume the file begins anew; with it a torn last line is cut off.
  int failed = ::ftruncate(fd_, resume_ ? whole_ : 0) == 0 ? 0 : errno;
  if (failed == 0 && (!resume_ || whole_ == 0)) {
    const std::string line = kFirst + run_ + "\"}\n";
    failed = append_whole(fd_, line);
    whole_ = static_cast<long>(line.size());
  }
  if (failed != 0) {
    ::close(std::exchange(fd_, -1));
    journal_fails(path_, failed);
  }
  begun_ = true;
  flush_folder_of(path_);
}

void Journal::add(const std::string& part, const std::string& bytes) {
  if (path_.empty()) return;
  if (!begun_) begin();
  const nlohmann::ordered_json entry = {
      {"part", part}, {"sha256", sum_of(part, bytes)}, {"hex", hex_of(bytes)}};
  const std::string line = entry.dump() + "\n";
  const int failed = append_whole(fd_, line);
  if (failed != 0) {
    // Half a line would spoil the next one.
    if (::ftruncate(fd_, whole_) != 0) errno = 0;
    journal_fails(path_, failed);
  }
  whole_ += static_cast<long>(line.size());
}

void Journal::keep(const std::string& part, const std::string& bytes) {
  const std::lock_guard lock(writing_);
  try {
    add(part, bytes);
  } catch (const InputError& error) {
    if (trouble_) trouble_(error.what());
  }
}

std::string Journal::kept(const std::string& part, const std::function<Part()>& compute) {
  if (const std::string* finished = find(part)) return *finished;
  Part computed = compute();
  if (computed.complete) keep(part, computed.bytes);
  return std::move(computed.bytes);
}

void Journal::remove() {
  if (path_.empty()) return;
  // A file that this run neither read nor wrote is another's.
  if (fd_ >= 0 || resume_) ::unlink(path_.c_str());
}

std::string run_fingerprint(const std::vector<std::string>& files, const std::string& options) {
  std::string all;
  std::vector<std::string> read = files;
  read.emplace_back("/proc/self/exe");
  for (const std::string& file : read) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw InputError({file, 0, 0}, "", "cannot read this file");
    std::ostringstream bytes;
    bytes << in.rdbuf();
    // The name too, because results hold it; no name contains a zero byte.
    all += file + '\0' + sha256_hex(bytes.str());
  }
  return sha256_hex(all + options);
}

}  // namespace sparflow
