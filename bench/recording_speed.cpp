/// Time and memory of reading recordings with several clocks.
///   recording_speed [MEGABYTES]      without an argument: 100
/// Writes a measurement file (MDF 4.10: one sorted group, deflate with transposition) and a bag (MCAP: joint states, chunks of
/// 1 MB with Zstandard) of that size into a temporary folder, and reads each in a process of its own. Prints what the file
/// holds, wall time, processor time and largest resident memory. Values are sums of sines and noise of a few steps of the sensor.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/mapping_proposal/channel_file.h"
#include "models/math/error.h"

namespace {

using namespace sparflow;

std::string low_first(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

template <typename Number>
void append(std::string* bytes, Number value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));  // little-endian, as the formats and this machine
  bytes->append(raw, sizeof(Number));
}

/// Slow sines with noise, as sensors of a machine.
class Signals {
 public:
  double value(std::size_t channel, double time) {
    const auto c = static_cast<double>(channel);
    return std::sin((0.1 + 0.07 * c) * time + c) + noise_(random_);
  }

 private:
  std::mt19937_64 random_{1};
  std::normal_distribution<double> noise_{0.0, 1e-3};
};

/// Blocks of an MDF file; a link is the place of a block written before.
class MdfFileWriter {
 public:
  explicit MdfFileWriter(const std::string& path) : out_(path, std::ios::binary) {
    write("MDF     4.10    bench   " + low_first(0, 4) + low_first(410, 2) + std::string(34, '\0'));
    write("##HD" + low_first(0, 4) + low_first(104, 8) + low_first(6, 8) + std::string(80, '\0'));
  }
  std::uint64_t block(const std::string& id, const std::vector<std::uint64_t>& links,
                      const std::string& data) {
    write(std::string((8 - at_ % 8) % 8, '\0'));
    const std::uint64_t place = at_;
    std::string head = "##" + id + low_first(0, 4) +
                       low_first(24 + 8 * links.size() + data.size(), 8) +
                       low_first(links.size(), 8);
    for (const std::uint64_t link : links) head += low_first(link, 8);
    write(head);
    write(data);
    return place;
  }
  void finish(std::uint64_t data_group) {
    out_.seekp(88);
    out_ << low_first(data_group, 8);
  }
  std::uint64_t size() const { return at_; }

 private:
  void write(const std::string& bytes) {
    out_ << bytes;
    at_ += bytes.size();
  }
  std::ofstream out_;
  std::uint64_t at_ = 0;
};

constexpr std::size_t kIntegers = 12, kReals = 6, kRecord = 8 + 2 * kIntegers + 4 * kReals;

std::string zipped_records(Signals* signals, std::uint64_t* row, std::size_t rows) {
  std::string records;
  for (std::size_t i = 0; i < rows; ++i, ++*row) {
    const double time = 1e-3 * static_cast<double>(*row);
    append(&records, time);
    for (std::size_t c = 0; c < kIntegers; ++c)
      append(&records, static_cast<std::int16_t>(2000.0 * signals->value(c, time)));
    for (std::size_t c = 0; c < kReals; ++c)
      append(&records, static_cast<float>(signals->value(kIntegers + c, time)));
  }
  std::string turned;
  turned.reserve(records.size());
  for (std::size_t c = 0; c < kRecord; ++c)
    for (std::size_t r = 0; r < rows; ++r) turned += records[r * kRecord + c];
  uLongf size = compressBound(turned.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(turned.data()), turned.size());
  packed.resize(size);
  return "DT" + low_first(1, 1) + low_first(0, 1) + low_first(kRecord, 4) +
         low_first(turned.size(), 8) + low_first(size, 8) + packed;
}

void write_mdf(const std::string& path, std::uint64_t bytes) {
  constexpr std::size_t kRowsOfBlock =
      75'000;  // 4 MB, the largest block that the standard recommends
  MdfFileWriter w(path);
  Signals signals;
  std::uint64_t rows = 0;
  std::vector<std::uint64_t> blocks = {0};
  while (w.size() < bytes)
    blocks.push_back(w.block("DZ", {}, zipped_records(&signals, &rows, kRowsOfBlock)));
  const std::size_t count = blocks.size() - 1;
  const auto list = w.block("DL", blocks,
                            low_first(1, 1) + low_first(0, 3) + low_first(count, 4) +
                                low_first(kRowsOfBlock * kRecord, 8));
  const auto data = w.block("HL", {list}, low_first(1, 2) + low_first(1, 1) + low_first(0, 5));
  std::string scale = low_first(1, 1) + low_first(0, 5) + low_first(2, 2) + std::string(16, '\0');
  append(&scale, 0.0);
  append(&scale, 5e-4);
  const auto rule = w.block("CC", {0, 0, 0, 0}, scale);
  std::uint64_t next = 0;
  const auto channel = [&](const std::string& name, unsigned type, unsigned data_type,
                           std::size_t byte, unsigned bits) {
    const auto text = w.block("TX", {}, name + '\0');
    next = w.block("CN", {next, 0, text, 0, data_type == 2 ? rule : 0, 0, 0, 0},
                   low_first(type, 1) + low_first(type == 2 ? 1 : 0, 1) + low_first(data_type, 1) +
                       low_first(0, 1) + low_first(byte, 4) + low_first(bits, 4) +
                       std::string(60, '\0'));
  };
  for (std::size_t c = kReals; c-- > 0;)
    channel(fmt::format("real{}", c), 0, 4, 8 + 2 * kIntegers + 4 * c, 32);
  for (std::size_t c = kIntegers; c-- > 0;) channel(fmt::format("int{}", c), 0, 2, 8 + 2 * c, 16);
  channel("t", 2, 4, 0, 64);
  const auto group = w.block("CG", {0, next, 0, 0, 0, 0},
                             low_first(0, 8) + low_first(rows, 8) + low_first(0, 8) +
                                 low_first(kRecord, 4) + low_first(0, 4));
  w.finish(w.block("DG", {0, group, data, 0}, low_first(0, 8)));
}

std::string mcap_record(unsigned opcode, const std::string& content) {
  return static_cast<char>(opcode) + low_first(content.size(), 8) + content;
}
std::string mcap_text(const std::string& t) { return low_first(t.size(), 4) + t; }

/// sensor_msgs/JointState of ten joints in CDR; the lengths are such that no number needs padding but the first.
std::string joint_state(Signals* signals, std::uint64_t nanoseconds) {
  constexpr std::size_t kJoints = 10;
  std::string m("\0\1\0\0", 4);
  append(&m, static_cast<std::int32_t>(nanoseconds / 1'000'000'000U));
  append(&m, static_cast<std::uint32_t>(nanoseconds % 1'000'000'000U));
  append(&m, std::uint32_t{4});
  m += std::string("arm\0", 4);
  append(&m, static_cast<std::uint32_t>(kJoints));
  for (std::size_t j = 0; j < kJoints; ++j) {
    append(&m, std::uint32_t{8});
    m += fmt::format("joint_{}", j) + '\0';
  }
  for (std::size_t list = 0; list < 3; ++list) {
    while ((m.size() - 4) % 4 != 0) m += '\0';
    append(&m, static_cast<std::uint32_t>(kJoints));
    while ((m.size() - 4) % 8 != 0) m += '\0';
    for (std::size_t j = 0; j < kJoints; ++j)
      append(&m, signals->value(10 * list + j, 1e-9 * static_cast<double>(nanoseconds)));
  }
  return m;
}

void write_mcap(const std::string& path, std::uint64_t bytes) {
  constexpr std::size_t kChunkBytes = 1'000'000;
  std::ofstream out(path, std::ios::binary);
  const std::string magic = "\x89MCAP0\r\n", rule(80, '=');
  out << magic << mcap_record(0x01, mcap_text("ros2") + mcap_text("bench"));
  const std::string definition =
      "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
      "float64[] effort\n" +
      rule +
      "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"
      "string frame_id\n";
  std::string records =
      mcap_record(0x03, low_first(1, 2) + mcap_text("sensor_msgs/msg/JointState") +
                            mcap_text("ros2msg") + mcap_text(definition)) +
      mcap_record(0x04, low_first(1, 2) + low_first(1, 2) + mcap_text("/joint_states") +
                            mcap_text("cdr") + low_first(0, 4));
  Signals signals;
  std::uint64_t time = 0;
  for (std::uint64_t written = 0; written < bytes;) {
    while (records.size() < kChunkBytes) {
      time += 2'000'000;  // 500 Hz
      records += mcap_record(0x05, low_first(1, 2) + low_first(0, 4) + low_first(time, 8) +
                                       low_first(time, 8) + joint_state(&signals, time));
    }
    std::string packed(ZSTD_compressBound(records.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), 1));
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(records.data()), static_cast<uInt>(records.size()));
    out << mcap_record(0x06, low_first(0, 16) + low_first(records.size(), 8) + low_first(crc, 4) +
                                 mcap_text("zstd") + low_first(packed.size(), 8) + packed);
    written += packed.size();
    records.clear();
  }
  out << mcap_record(0x0F, low_first(0, 4)) << mcap_record(0x02, std::string(20, '\0')) << magic;
}

/// Reads the file in a process of its own and prints a row.
void read_and_print(const char* name, const std::string& path) {
  int ends[2];
  SPARFLOW_CHECK(::pipe(ends) == 0, "no pipe");
  const auto begin = std::chrono::steady_clock::now();
  const pid_t pid = ::fork();
  SPARFLOW_CHECK(pid >= 0, "no child process");
  if (pid == 0) {
    std::string said;
    try {
      const TimedChannels file = read_timed_channels(path);
      std::size_t values = 0;
      for (const RecordedChannel& c : file.recording.channels) values += c.values.size();
      said = fmt::format("{} {}", file.recording.channels.size(), values);
    } catch (const std::exception& e) {
      said = e.what();
    }
    const ssize_t done = ::write(ends[1], said.data(), said.size());
    ::_exit(done == static_cast<ssize_t>(said.size()) ? 0 : 1);
  }
  ::close(ends[1]);
  char text[500];
  const ssize_t length = ::read(ends[0], text, sizeof(text) - 1);
  ::close(ends[0]);
  int status = 0;
  struct rusage usage {};
  ::wait4(pid, &status, 0, &usage);
  const double wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  text[std::max<ssize_t>(length, 0)] = '\0';
  char* rest = nullptr;
  const long channels = std::strtol(text, &rest, 10);
  const double values = std::strtod(rest, nullptr);
  if (channels == 0 || values == 0.0) throw std::runtime_error(fmt::format("{}: {}", name, text));
  const double cpu = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                     1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  const double megabytes = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  fmt::print("{:<22} {:>8.1f} {:>9} {:>12.3g} {:>8.2f} {:>8.2f} {:>8.0f} {:>12.1f}\n", name,
             megabytes, channels, values, wall, cpu,
             static_cast<double>(usage.ru_maxrss) * 1024.0 / 1e6, megabytes / cpu);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const double megabytes = argc > 1 ? std::strtod(argv[1], nullptr) : 100.0;
    const auto bytes = static_cast<std::uint64_t>(1e6 * megabytes);
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / fmt::format("sparflow_recordings_{}", ::getpid());
    std::filesystem::create_directories(folder);
    write_mdf((folder / "bench.mf4").string(), bytes);
    write_mcap((folder / "bench.mcap").string(), bytes);
    fmt::print("{:<22} {:>8} {:>9} {:>12} {:>8} {:>8} {:>8} {:>12}\n", "file", "MB", "channels",
               "values", "wall s", "cpu s", "MB held", "MB/s of cpu");
    read_and_print("MDF 4.10, deflate", (folder / "bench.mf4").string());
    read_and_print("MCAP, zstd", (folder / "bench.mcap").string());
    std::filesystem::remove_all(folder);
  } catch (const std::exception& e) {
    fmt::print(stderr, "recording_speed: {}\n", e.what());
    return 1;
  }
}
