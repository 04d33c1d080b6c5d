/// Times the exact law on many states in a plain loop: what an array call of the Python module (bench/python_overhead.py) is
/// held against. It reads rows of q and qd and the model from files and prints the seconds of one pass, median of `repeats`.
///   build/bench/law_on_states MODEL.json STATES.bin ROWS PAYLOAD_KG [REPEATS]
/// STATES.bin holds ROWS x joints doubles of q, then as many of qd.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

namespace {

using namespace sparflow;

std::vector<double> numbers_of(const char* path, std::size_t count) {
  std::vector<double> values(count);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(count * sizeof(double)));
  if (!in) throw InputError({path, 0, 0}, "", fmt::format("expected {} doubles", count));
  return values;
}

/// One pass over all states. @return seconds, with the pumps' power by row in `power`
double pass(const CraneModel& model, const std::vector<double>& states, double payload,
            std::vector<double>& power) {
  const std::size_t joints = model.machine.joints.size(), rows = power.size();
  const auto begin = std::chrono::steady_clock::now();
  Chain chain(model);
  for (std::size_t k = 0; k < rows; ++k)
    power[k] =
        chain.evaluate({states.data() + k * joints, states.data() + (rows + k) * joints}, payload)
            .power;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int main(int count, char** words) {
  if (count < 5) {
    fmt::print(stderr, "usage: law_on_states MODEL.json STATES.bin ROWS PAYLOAD_KG [REPEATS]\n");
    return 2;
  }
  try {
    const CraneModel model = load_model(words[1]);
    const auto rows = static_cast<std::size_t>(std::strtoul(words[3], nullptr, 10));
    const std::vector<double> states = numbers_of(words[2], 2 * rows * model.machine.joints.size());
    const double payload = std::strtod(words[4], nullptr);
    const long repeats = count > 5 ? std::strtol(words[5], nullptr, 10) : 5;
    std::vector<double> power(rows), seconds;
    for (long k = 0; k < repeats; ++k) seconds.push_back(pass(model, states, payload, power));
    std::sort(seconds.begin(), seconds.end());
    double sum = 0.0;
    for (const double p : power) sum += p;
    fmt::print("{:.9g} {:.17g}\n", seconds[seconds.size() / 2], sum);
    return 0;
  } catch (const InputError& e) {
    fmt::print(stderr, "law_on_states: {}\n", e.what());
    return 3;
  }
}
