#include "bench/program_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "models/math/error.h"

namespace sparflow::bench {

struct ProgramOptions::App {
  CLI::App app;
  CLI::Option* last = nullptr;
};

ProgramOptions::ProgramOptions(const std::string& what_it_does) : app_(std::make_unique<App>()) {
  app_->app.description(what_it_does);
}
ProgramOptions::~ProgramOptions() = default;

ProgramOptions& ProgramOptions::range(double lo, double hi) {
  app_->last->check(CLI::Range(lo, hi));
  return *this;
}

ProgramOptions& ProgramOptions::positive() {
  app_->last->check(CLI::PositiveNumber);
  return *this;
}

ProgramOptions& ProgramOptions::one_of(const std::vector<std::string>& values) {
  app_->last->check(CLI::IsMember(values));
  return *this;
}

ProgramOptions& ProgramOptions::required() {
  app_->last->required();
  return *this;
}

ProgramOptions& ProgramOptions::add(const std::string& name, int& value, const std::string& help) {
  app_->last = app_->app.add_option(name, value, help)->capture_default_str();
  return *this;
}

ProgramOptions& ProgramOptions::add(const std::string& name, std::uint64_t& value,
                                    const std::string& help) {
  app_->last = app_->app.add_option(name, value, help)->capture_default_str();
  return *this;
}

ProgramOptions& ProgramOptions::add(const std::string& name, double& value,
                                    const std::string& help) {
  app_->last = app_->app.add_option(name, value, help)->capture_default_str();
  return *this;
}

ProgramOptions& ProgramOptions::add(const std::string& name, std::string& value,
                                    const std::string& help) {
  app_->last = app_->app.add_option(name, value, help)->capture_default_str();
  return *this;
}

ProgramOptions& ProgramOptions::add(const std::string& name, std::vector<std::string>& value,
                                    const std::string& help) {
  app_->last = app_->app.add_option(name, value, help)->delimiter(',');
  return *this;
}

ProgramOptions& ProgramOptions::flag(const std::string& name, bool& value,
                                     const std::string& help) {
  app_->last = app_->app.add_flag(name, value, help);
  return *this;
}

std::optional<int> ProgramOptions::parse(int argc, char** argv) {
  try {
    app_->app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

int run_program(const char* name, int (*run)(int, char**), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 3;
  }
}

}  // namespace sparflow::bench
