/// Measures the time of one evaluation of a GP mean (value; value + gradient + Hessian) over the number of centres for
/// every instruction set of this machine, beside a plain loop over std::exp. After Google Benchmark's table a second one
/// gives the times and their ratio to the plain loop.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "models/hydraulics/gp_kernel.h"

namespace {

using sparflow::KernelCentres;
using sparflow::KernelIsa;
using sparflow::KernelSums;

/// Centres spread over a few length-scales as in an identified pressure model, and queries among them.
struct Problem {
  std::vector<double> x, y, weight, query_x, query_y;
  explicit Problem(std::size_t n)
      : x(sparflow::kernel_padded(n)), y(x.size()), weight(x.size()), query_x(256), query_y(256) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> place(0.0, 3.3);
    std::normal_distribution<double> normal;
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = place(random);
      y[j] = place(random);
      weight[j] = normal(random);
    }
    for (double& value : query_x) value = place(random);
    for (double& value : query_y) value = place(random);
  }
  KernelCentres centres() const { return {x.data(), y.data(), weight.data(), x.size()}; }
};

double plain_value(const Problem& p, std::size_t n, double x, double y) {
  double sum = 0.0;
  for (std::size_t j = 0; j < n; ++j) {
    const double u = x - p.x[j], v = y - p.y[j];
    sum += p.weight[j] * std::exp(-0.5 * (u * u + v * v));
  }
  return sum;
}

KernelSums plain_derivatives(const Problem& p, std::size_t n, double x, double y) {
  KernelSums s;
  for (std::size_t j = 0; j < n; ++j) {
    const double u = x - p.x[j], v = y - p.y[j];
    const double e = p.weight[j] * std::exp(-0.5 * (u * u + v * v));
    s.value += e;
    s.d_x -= e * u;
    s.d_y -= e * v;
    s.d_xx += e * (u * u - 1.0);
    s.d_xy += e * u * v;
    s.d_yy += e * (v * v - 1.0);
  }
  return s;
}

template <class Evaluate>
void run(benchmark::State& state, const Problem& problem, Evaluate evaluate) {
  std::size_t i = 0;
  for (auto _ : state) {
    auto result = evaluate(problem.query_x[i & 255], problem.query_y[i & 255]);
    benchmark::DoNotOptimize(result);
    ++i;
  }
}

void add(const std::string& how, KernelIsa isa, std::size_t n) {
  const bool plain = how == "plain";
  const auto name = [&](const char* what) { return fmt::format("{}/{}/{}", what, how, n); };
  benchmark::RegisterBenchmark(name("value").c_str(), [=](benchmark::State& state) {
    const Problem problem(n);
    sparflow::set_kernel_isa(isa);
    if (plain) {
      run(state, problem, [&](double x, double y) { return plain_value(problem, n, x, y); });
    } else {
      run(state, problem, [&](double x, double y) { return kernel_sum(problem.centres(), x, y); });
    }
  });
  benchmark::RegisterBenchmark(name("mean+gradient+Hessian").c_str(), [=](benchmark::State& state) {
    const Problem problem(n);
    sparflow::set_kernel_isa(isa);
    if (plain) {
      run(state, problem, [&](double x, double y) { return plain_derivatives(problem, n, x, y); });
    } else {
      run(state, problem,
          [&](double x, double y) { return kernel_sum_derivatives(problem.centres(), x, y); });
    }
  });
}

/// Google Benchmark's console table, which also stores the times for the summary.
class Reporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      double& best = nanoseconds_.try_emplace(run.run_name.function_name, INFINITY).first->second;
      if (run.run_type == Run::RT_Iteration) best = std::min(best, run.GetAdjustedCPUTime());
    }
    ConsoleReporter::ReportRuns(runs);
  }
  double time(const std::string& name) const {
    const auto found = nanoseconds_.find(name);
    return found == nanoseconds_.end() ? NAN : found->second;
  }

 private:
  std::map<std::string, double> nanoseconds_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  std::vector<std::pair<std::string, KernelIsa>> hows = {{"plain", KernelIsa::kBaseline}};
  for (KernelIsa isa : {KernelIsa::kBaseline, KernelIsa::kAvx2, KernelIsa::kAvx512}) {
    if (sparflow::kernel_isa_available(isa)) hows.emplace_back(sparflow::kernel_isa_name(isa), isa);
  }
  const std::vector<std::size_t> counts = {50, 100, 200, 300, 1000};
  for (std::size_t n : counts) {
    for (const auto& [how, isa] : hows) add(how, isa, n);
  }
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();

  fmt::print("\nmicroseconds per evaluation (x faster than the plain loop over std::exp)\n");
  for (const char* what : {"value", "mean+gradient+Hessian"}) {
    fmt::print("{:<24}", what);
    for (const auto& [how, isa] : hows) fmt::print("{:>17}", how);
    fmt::print("\n");
    for (std::size_t n : counts) {
      const double plain = reporter.time(fmt::format("{}/plain/{}", what, n));
      fmt::print("{:>16} centres", n);
      for (const auto& [how, isa] : hows) {
        const double t = reporter.time(fmt::format("{}/{}/{}", what, how, n));
        fmt::print("{:>9.3f} ({:>4.1f}x)", 1e-3 * t, plain / t);
      }
      fmt::print("\n");
    }
  }
  return 0;
}
