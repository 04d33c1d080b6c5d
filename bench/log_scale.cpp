/// How time and memory of the verbs grow with the length of a log.
///   log_scale [ROWS...]      without arguments: 12000 50000 100000 200000 400000 2000000
/// The bundled log is repeated, with a pause of a second between its repetitions. Each verb runs in a process of its own
/// (build/sparflow). Prints wall time, processor time, largest resident memory and, from row to row, the exponent with
/// which processor time grows (wall time grows with whatever else the machine does); diagnose is left out above 400000 rows.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "models/math/door.h"
#include "models/math/error.h"

namespace {

using namespace sparflow;

/// Rows above which diagnose is left out.
constexpr long kMostForDiagnose = 400'000;

struct Used {
  double seconds = 0.0;    ///< wall time
  double processor = 0.0;  ///< [s] of all threads
  double megabytes = 0.0;  ///< largest resident memory
};

Used run(const std::vector<std::string>& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const pid_t pid = ::fork();
  SPARFLOW_CHECK(pid >= 0, "no child process");
  if (pid == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    std::vector<char*> words;
    words.reserve(arguments.size() + 1);
    for (const std::string& a : arguments) words.push_back(const_cast<char*>(a.c_str()));
    words.push_back(nullptr);
    ::execv(words[0], words.data());
    ::_exit(127);
  }
  int status = 0;
  struct rusage usage {};
  ::wait4(pid, &status, 0, &usage);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error(
        fmt::format("{} {} ended with status {}", arguments[0], arguments[1], status));
  }
  const auto of = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
          of(usage.ru_utime) + of(usage.ru_stime), static_cast<double>(usage.ru_maxrss) / 1024.0};
}

/// The bundled log, repeated up to `rows` rows.
void write_log(const std::string& path, long rows) {
  std::istringstream lines(read_bytes(
      std::string(SPARFLOW_SOURCE_DIR) + "/problems/logs/loader_crane_train.csv", 100'000'000));
  std::string header, line;
  std::getline(lines, header);
  std::vector<std::pair<double, std::string>> all;
  while (std::getline(lines, line)) {
    const std::size_t comma = line.find(',');
    all.emplace_back(std::stod(line.substr(0, comma)), line.substr(comma));
  }
  const double period = all.back().first + 1.0;
  std::ofstream out(path);
  out << header << '\n';
  for (long k = 0; k < rows; ++k) {
    const auto& [t, rest] = all[static_cast<std::size_t>(k) % all.size()];
    const long round = k / static_cast<long>(all.size());
    out << fmt::format("{:.3f}{}\n", t + period * static_cast<double>(round), rest);
  }
}

void table(const std::vector<long>& sizes) {
  const std::string program = std::string(SPARFLOW_BINARY_DIR) + "/sparflow";
  const std::string machine =
      std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml";
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("sparflow_scale_{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto in = [&](const char* name) { return (folder / name).string(); };
  fmt::print("{:>9}  {:<9} {:>8} {:>8} {:>9} {:>9}\n", "rows", "verb", "wall s", "cpu s", "MB",
             "exponent");
  std::map<std::string, std::pair<double, double>>
      before;  // rows and processor time [s] of the size before
  for (const long rows : sizes) {
    write_log(in("log.csv"), rows);
    std::vector<std::pair<std::string, std::vector<std::string>>> verbs = {
        {"fit", {program, "fit", "-m", machine, "-l", in("log.csv"), "-o", in("model.json")}},
        {"compare", {program, "compare", "--model", in("model.json"), "-l", in("log.csv")}}};
    if (rows <= kMostForDiagnose)
      verbs.push_back(
          {"diagnose", {program, "diagnose", "--model", in("model.json"), "-l", in("log.csv")}});
    for (const auto& [verb, arguments] : verbs) {
      const Used used = run(arguments);
      const auto n = static_cast<double>(rows);
      const auto last = before.find(verb);
      const std::string exponent =
          last == before.end()
              ? std::string()
              : fmt::format("{:.2f}", std::log(used.processor / last->second.second) /
                                          std::log(n / last->second.first));
      fmt::print("{:>9}  {:<9} {:>8.1f} {:>8.1f} {:>9.0f} {:>9}\n", rows, verb, used.seconds,
                 used.processor, used.megabytes, exponent);
      std::fflush(stdout);
      before[verb] = {n, used.processor};
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<long> sizes;
    for (int i = 1; i < argc; ++i) sizes.push_back(std::strtol(argv[i], nullptr, 10));
    if (sizes.empty()) sizes = {12'000, 50'000, 100'000, 200'000, 400'000, 2'000'000};
    table(sizes);
  } catch (const std::exception& e) {
    fmt::print(stderr, "log_scale: {}\n", e.what());
    return 1;
  }
}
