#include "tests/fuzz/targets.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>

#include "identification/log/log.h"
#include "identification/log/log_columns.h"
#include "identification/log/log_mapping.h"
#include "identification/log/log_matlab.h"
#include "identification/log/mat_file.h"
#include "identification/log/one_clock.h"
#include "identification/log/recordings/can/dbc.h"
#include "identification/log/recordings/recording_formats.h"
#include "models/effects/formula/effect_file.h"
#include "models/expression/expression.h"
#include "models/expression/unit_algebra.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/files/urdf_import.h"
#include "models/math/door.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"
#include "problems/problem_file.h"

/// Where joints form nothing but a circle, liburdfdom refuses the file and forgets the links, which own each other.
// NOLINTNEXTLINE(bugprone-reserved-identifier): the sanitizer's name
extern "C" const char* __lsan_default_suppressions() { return "leak:urdf::parseURDF\n"; }

namespace sparflow::fuzz {
namespace {

const Machine& crane() {
  static const Machine machine =
      load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml");
  return machine;
}

/// Calls a reader; refusals are answers. @return whether it took what it got
template <class Read>
bool answered(const Read& read) {
  try {
    read();
    return true;
  } catch (const InputError&) {
  } catch (const TextError&) {
  } catch (const UsageError&) {
  }
  return false;
}

bool read_log(const std::string& bytes) {
  return answered([&] { log_from_text("log.csv", bytes, crane()); });
}

bool read_mat_log(const std::string& bytes) {
  // version 7.3 is HDF5's affair, which reads the file itself
  if (!is_mat_before_73(bytes)) return false;
  DoorLimits limits;
  limits.log_bytes = 20'000'000;
  return answered([&] { read_matlab("log.mat", bytes, limits); });
}

bool read_machine_file(const std::string& bytes) {
  return answered([&] { parse_machine(text_as_utf8("m.yaml", bytes), "m.yaml", "/nonexistent"); });
}

bool read_problem(const std::string& bytes) {
  return answered(
      [&] { parse_problem(text_as_utf8("p.yaml", bytes), "p.yaml", "/nonexistent", &crane()); });
}

bool read_model(const std::string& bytes) {
  return answered([&] { model_from_json(text_as_utf8("m.json", bytes), "m.json"); });
}

bool read_mapping(const std::string& bytes) {
  return answered([&] {
    const LogMapping mapping = parse_log_mapping("map.yaml", text_as_utf8("map.yaml", bytes));
    RawTable table = read_delimited("log.csv", "t;x;y\n0;1;2\n1;2;3\n", mapping.dialect);
    apply_mapping(mapping, &table);
  });
}

bool read_effects(const std::string& bytes) {
  return answered([&] { parse_user_effects(text_as_utf8("e.yaml", bytes), "e.yaml", &crane()); });
}

bool read_expression(const std::string& bytes) {
  const bool read = answered([&] {
    RawTable table = read_delimited("log.csv", "t;x;Time [ms]\n0;1;2\n1;2;3\n", {});
    evaluate_expression(bytes, table, {"map.yaml", 1, 1}, "columns.t_s");
  });
  return answered([&] { parse_unit(bytes); }) || read;
}

bool read_urdf(const std::string& bytes) {
  // a file that is nowhere in the file system, because the reader takes a path
  const int fd = ::memfd_create("urdf", MFD_CLOEXEC);
  if (fd < 0 || ::write(fd, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    std::abort();
  const std::string path = fmt::format("/proc/self/fd/{}", fd);
  std::map<std::string, JointLimitsOverride> limits;
  const bool read = answered([&] { import_urdf(path, "", limits, {"m.yaml", 1, 1}); });
  ::close(fd);
  return read;
}

bool read_any_recording(const std::string& bytes) {
  RecordingOptions options;
  options.dbc_files = {std::string(SPARFLOW_SOURCE_DIR) + "/tests/fuzz/corpus/dbc/bus.dbc"};
  options.limits.log_bytes = 20'000'000;
  options.limits.log_values = 1'000'000;
  return answered([&] {
    const Recording recording = read_recording(bytes, "log.mf4", options);
    ClockOptions clock;
    clock.limits = options.limits;
    on_one_clock(recording, clock);
  });
}

bool read_dbc(const std::string& bytes) {
  return answered([&] {
    const Dbc dbc = parse_dbc("bus.dbc", text_as_utf8("bus.dbc", bytes));
    // the first frame of every message, all ones
    const std::vector<std::uint8_t> frame(64, 0xFF);
    for (const DbcMessage& message : dbc.messages)
      for (const DbcSignal& signal : message.signals)
        if (signal.bytes() <= frame.size()) dbc_value(signal, dbc_bits(signal, frame));
  });
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> all = {
      {"log", read_log, {}},
      {"mat", read_mat_log, {}},
      {"recording", read_any_recording, {}},
      {"dbc", read_dbc, {}},
      {"machine",
       read_machine_file,
       {"machines/loader_crane.yaml", "machines/excavator.yaml", "machines/emps.yaml"}},
      {"problem",
       read_problem,
       {"reaches/loader_crane_lift.yaml", "reaches/loader_crane_over_wall.yaml"}},
      {"model", read_model, {"models/loader_crane.json"}},
      {"mapping", read_mapping, {}},
      {"effects", read_effects, {"effects/seal_friction.yaml"}},
      {"expression", read_expression, {}},
      {"urdf", read_urdf, {"machines/urdf_crane.urdf"}}};
  return all;
}

}  // namespace sparflow::fuzz

#ifdef SPARFLOW_LIBFUZZER
/// One program for all: the environment says which reader. tests/fuzz/README.md
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const sparflow::fuzz::Target* const target = [] {
    const char* name = std::getenv("SPARFLOW_FUZZ_TARGET");
    for (const auto& t : sparflow::fuzz::targets()) {
      if (name != nullptr && std::strcmp(t.name, name) == 0) return &t;
    }
    std::abort();
  }();
  target->read(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
#endif
