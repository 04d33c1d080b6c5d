/// The one way to write a file.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
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

/// A new file in a folder, open for writing. Where the file system serves, it has no name before it is whole, so that the
/// kernel removes it with a process that is killed.
struct NewFile {
  int fd = -1;
  std::string name;  ///< "" while it has none
};

std::string path_of_open(int fd) { return fmt::format("/proc/self/fd/{}", fd); }

NewFile new_file_in(const std::string& folder, bool with_name) {
  NewFile file;
  if (!with_name) {
    file.fd = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
    return file;
  }
  file.name = folder + "/.sparflow-XXXXXX";
  file.fd = ::mkostemp(file.name.data(), O_CLOEXEC);
  return file;
}

/// Gives a file without a name one that no other file has, in the folder. @return 0, or the error
int give_name(NewFile& file, const std::string& folder) {
  const std::string open_file = path_of_open(file.fd);
  /// Names that are tried.
  /// @threshold [1] 2..1000; chosen: each of them is free but for one in 2^32 or where an earlier kill left it
  constexpr int kNames = 20;
  for (int i = 0; i < kNames; ++i) {
    unsigned int number = 0;
    if (::getrandom(&number, sizeof number, 0) != sizeof number) return errno;
    const std::string name = fmt::format("{}/.sparflow-{:08x}", folder, number);
    if (::linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
      file.name = name;
      return 0;
    }
    if (errno != EEXIST) return errno;
  }
  return EEXIST;
}

/// Puts a whole file in the place of `target`. A target that is not there takes the file in one step; one that is there can
/// only be replaced by a file with a name, which it has for that instant. @return 0, or the error
int put_in_place(NewFile& file, const std::string& target, const std::string& folder) {
  if (file.name.empty()) {
    const std::string open_file = path_of_open(file.fd);
    if (::linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, target.c_str(), AT_SYMLINK_FOLLOW) == 0)
      return 0;
    const int failed = errno == EEXIST ? give_name(file, folder) : errno;
    if (failed != 0) return failed;
  }
  return ::rename(file.name.c_str(), target.c_str()) == 0 ? 0 : errno;
}

/// Writes beside `target` and replaces it. @param before what is there, or null  @return 0, or the error
int replace(const std::string& target, const std::string& content, const struct stat* before,
            bool with_name) {
  const std::string folder = folder_of(target);
  NewFile file = new_file_in(folder, with_name);
  if (file.fd < 0) return errno;
  int failed = write_whole(file.fd, content);
  if (failed == 0) failed = keep_mode(file.fd, before);
  if (failed == 0 && ::fsync(file.fd) != 0 && errno != EINVAL) failed = errno;
  // Before it is closed: a file without a name ends with its last descriptor.
  if (failed == 0) failed = put_in_place(file, target, folder);
  if (::close(file.fd) != 0 && failed == 0) failed = errno;
  if (failed != 0 && !file.name.empty()) ::unlink(file.name.c_str());
  if (failed == 0) flush_folder(folder);
  return failed;
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
  const struct stat* there = exists ? &before : nullptr;
  // Network and layered file systems know no file without a name, or cannot name it later; nor can any without /proc.
  if (replace(target, content, there, false) == 0) return;
  const int failed = replace(target, content, there, true);
  if (failed != 0) cannot_write(path, failed);
}

}  // namespace sparflow
