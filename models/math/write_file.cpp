/// The one way to write a file.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

#include "models/math/error.h"

namespace sparflow {
namespace {

[[noreturn]] void cannot_write(const std::string& path, int reason) {
  throw InputError({path, 0, 0}, "", fmt::format("cannot write: {}", std::strerror(reason)));
}

/// @return 0, or the error
int write_whole(int fd, const std::string& content) {
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    done += static_cast<std::size_t>(n);
  }
  return 0;
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

/// The path behind symbolic links, also where the last of them leads to a file that does not exist yet.
std::string behind_links(std::string path) {
  /// Links that are followed.
  /// @threshold [1] 8..1000; chosen: as many as the kernel follows
  constexpr int kLinks = 40;
  for (int i = 0; i < kLinks; ++i) {
    std::array<char, PATH_MAX> target{};
    const ssize_t n = ::readlink(path.c_str(), target.data(), target.size());
    if (n < 0) return path;
    const std::string next(target.data(), static_cast<std::size_t>(n));
    path = next.starts_with('/') ? next : folder_of(path) + "/" + next;
  }
  cannot_write(path, ELOOP);
}

/// Whether `file` is what standard output or standard error go to; to replace it would lose what is printed there.
bool is_own_output(const struct stat& file) {
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat own {};
    if (::fstat(fd, &own) == 0 && own.st_dev == file.st_dev && own.st_ino == file.st_ino)
      return true;
  }
  return false;
}

/// Devices, FIFOs and the like keep being what they are.
void write_through(const std::string& path, const std::string& content, bool append) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | (append ? O_APPEND : 0));
  if (fd < 0) cannot_write(path, errno);
  const int failed = write_whole(fd, content);
  const bool closed = ::close(fd) == 0;
  if (failed != 0) cannot_write(path, failed);
  if (!closed) cannot_write(path, errno);
}

/// The mode and, where allowed, the owner of the file that is replaced; those of any new file otherwise.
int keep_mode(int fd, const struct stat* before) {
  if (before == nullptr) {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    return ::fchmod(fd, 0666 & ~mask) == 0 ? 0 : errno;
  }
  // Another owner than this process' own can be kept by root only, and is no reason not to write.
  if (::fchown(fd, before->st_uid, before->st_gid) != 0) errno = 0;
  return ::fchmod(fd, before->st_mode & 07777) == 0 ? 0 : errno;
}

/// So that the renaming itself survives a loss of power; file systems that cannot do it are none the worse.
void flush_folder(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

void write_file_atomically(const std::string& path, const std::string& content) {
  struct stat before {};
  const bool exists = ::stat(path.c_str(), &before) == 0;
  if (exists && S_ISDIR(before.st_mode)) cannot_write(path, EISDIR);
  if (exists && (!S_ISREG(before.st_mode) || is_own_output(before))) {
    write_through(path, content, S_ISREG(before.st_mode));
    return;
  }
  // A file that may not be written is not replaced either, though its folder would allow it.
  if (exists && ::access(path.c_str(), W_OK) != 0) cannot_write(path, errno);
  const std::string target = behind_links(path);
  std::string aside = folder_of(target) + "/.sparflow-XXXXXX";
  const int fd = ::mkostemp(aside.data(), O_CLOEXEC);
  if (fd < 0) cannot_write(path, errno);
  int failed = write_whole(fd, content);
  if (failed == 0) failed = keep_mode(fd, exists ? &before : nullptr);
  if (failed == 0 && ::fsync(fd) != 0 && errno != EINVAL) failed = errno;
  if (::close(fd) != 0 && failed == 0) failed = errno;
  if (failed == 0 && ::rename(aside.c_str(), target.c_str()) != 0) failed = errno;
  if (failed != 0) {
    ::unlink(aside.c_str());
    cannot_write(path, failed);
  }
  flush_folder(folder_of(target));
}

}  // namespace sparflow
