#pragma once
/// Tables, JSON, CSV and page of `benchmark`.
#include <map>
#include <string>
#include <vector>

#include "apps/report/motion_pages/benchmark_page.h"
#include "simulator/benchmark/scenario.h"
#include "simulator/benchmark/summary.h"

namespace sparflow {

/// All that a benchmark has found.
struct BenchmarkResult {
  std::vector<benchmark::Scenario> scenarios;
  std::vector<std::string> controllers, words;  ///< names, and what each does
  std::string reference;                        ///< that others are compared with
  std::vector<benchmark::Row> rows;
  std::map<std::string, benchmark::Promise> promises;  ///< by scenario
  std::map<std::string, std::string> no_promise;       ///< why a scenario has none
  std::vector<benchmark::ControllerSummary> summary;
  int broken = 0;  ///< processes that ended without a result
  bool interrupted = false;
  bool any_done() const;  ///< whether any run was
};

std::string benchmark_headline(const BenchmarkResult& result);
std::string benchmark_table(const BenchmarkResult& result);
std::string benchmark_json(const BenchmarkResult& result);
std::string benchmark_csv(const BenchmarkResult& result);
BenchmarkView benchmark_view(const BenchmarkResult& result);

}  // namespace sparflow
