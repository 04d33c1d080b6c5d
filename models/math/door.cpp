#include "models/math/door.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

struct Listener {
  std::mutex mutex;
  std::function<void(const std::string&)> heard;
};

Listener& listener() {
  static Listener one;
  return one;
}

void say_at_door(const std::string& sentence) {
  const std::lock_guard lock(listener().mutex);
  if (listener().heard) listener().heard(sentence);
}

/// A descriptor that closes itself.
struct OpenFile {
  explicit OpenFile(const std::string& path) : fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (fd >= 0) ::close(fd);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int fd;
};

[[noreturn]] void unreadable(const std::string& path, const std::string& why) {
  throw InputError({path, 0, 0}, "", "cannot read: " + why);
}

[[noreturn]] void too_large(const std::string& path, std::int64_t limit) {
  throw InputError({path, 0, 0}, "",
                   fmt::format("the file is larger than {:g} MB, the limit for such a file; is it "
                               "the right one? (docs/limits.md)",
                               static_cast<double>(limit) / 1e6));
}

}  // namespace

bool is_file(const std::string& path) {
  struct stat about {};
  return path.find('\0') == std::string::npos && ::stat(path.c_str(), &about) == 0 &&
         S_ISREG(about.st_mode);
}

void set_door_listener(std::function<void(const std::string&)> heard) {
  const std::lock_guard lock(listener().mutex);
  listener().heard = std::move(heard);
}

std::string read_bytes(const std::string& path, std::int64_t limit) {
  const OpenFile file(path);
  if (file.fd < 0) unreadable(path, fmt::format("{}; check the path", std::strerror(errno)));
  struct stat about {};
  if (::fstat(file.fd, &about) != 0) unreadable(path, std::strerror(errno));
  if (S_ISDIR(about.st_mode)) unreadable(path, "this is a folder; give a file in it");
  if (S_ISREG(about.st_mode) && about.st_size > limit) too_large(path, limit);
  std::string bytes;
  // one byte more than expected shows the end without another allocation
  /// Block in which pipes and devices are read.
  /// @threshold [byte] 1e3..1e8; chosen: few calls, little memory
  constexpr std::size_t kBlock = 1U << 20U;
  std::size_t size = 0;
  bytes.resize(S_ISREG(about.st_mode) ? static_cast<std::size_t>(about.st_size) + 1 : kBlock);
  for (;;) {
    if (size == bytes.size()) bytes.resize(size + std::max(kBlock, size / 2));
    const ssize_t n = ::read(file.fd, bytes.data() + size, bytes.size() - size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) unreadable(path, std::strerror(errno));
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
    if (static_cast<std::int64_t>(size) > limit) too_large(path, limit);
  }
  bytes.resize(size);
  return bytes;
}

std::string read_text(const std::string& path) {
  std::vector<std::string> warnings;
  std::string text = text_as_utf8(path, read_bytes(path, DoorLimits{}.text_bytes), &warnings);
  for (const std::string& w : warnings) say_at_door(path + ": " + w);
  return text;
}

}  // namespace sparflow
