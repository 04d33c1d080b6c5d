#include "bench/program_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "models/math/error.h"

namespace sparflow::bench {

struct ProgramOptions::App {
  CLI::App app;
  CLI::Option* last = nullptr;
  std::string journal;
  bool resume = false;
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

ProgramOptions& ProgramOptions::add_journal() {
  add("--journal", app_->journal,
      "file of the finished parts, written as soon as each is complete");
  return flag("--resume", app_->resume, "take the parts that the journal has, compute the others");
}

std::unique_ptr<Journal> ProgramOptions::journal(
    const std::vector<std::string>& files, const std::vector<std::string>& not_of_result) const {
  if (app_->journal.empty()) {
    if (app_->resume) throw UsageError("--resume needs --journal FILE");
    return std::make_unique<Journal>();
  }
  std::string options;
  for (const CLI::Option* option : app_->app.get_options()) {
    const std::string name = option->get_name();
    const bool other =
        name == "--journal" || name == "--resume" ||
        std::find(not_of_result.begin(), not_of_result.end(), name) != not_of_result.end();
    if (!other && option->count() > 0)
      options += fmt::format("{} {}\n", name, fmt::join(option->results(), " "));
  }
  auto journal =
      std::make_unique<Journal>(app_->journal, run_fingerprint(files, options), app_->resume);
  const auto tell = [](const std::string& sentence) { fmt::print(stderr, "{}\n", sentence); };
  journal->on_trouble(tell);
  for (const std::string& sentence : journal->warnings()) tell(sentence);
  if (journal->finished() > 0)
    tell(fmt::format("{} parts were finished before", journal->finished()));
  return journal;
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
