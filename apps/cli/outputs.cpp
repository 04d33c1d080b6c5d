#include "apps/cli/outputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "apps/cli/console.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

constexpr const char* kStandardOutput = "-";

}  // namespace

void Outputs::add_to(CLI::App& verb, bool with_report) {
  verb.add_option(
          "--json", json,
          "write the result to FILE as JSON; - is standard output, and texts then go to stderr")
      ->type_name("FILE");
  if (with_report) {
    verb.add_option("--report", report,
                    "write a page with figures to FILE.html; it needs no network")
        ->type_name("FILE.html");
  }
}

void Outputs::add_resume_to(CLI::App& verb) {
  verb.add_flag("--resume", resume,
                "take what an earlier run, ended before it was complete, has finished; it stands "
                "in FILE.journal beside the JSON (or the page)");
}

std::string Outputs::journal(const std::string& own) const {
  const bool no_json = json.empty() || json == kStandardOutput;
  const std::string& beside = !no_json ? json : report.empty() ? own : report;
  std::error_code error;
  const bool other =
      std::filesystem::exists(beside, error) && !std::filesystem::is_regular_file(beside, error);
  return beside.empty() || other ? "" : beside + ".journal";
}

std::unique_ptr<Journal> Outputs::open_journal(const std::string& verb, const std::string& run,
                                               const std::string& own) const {
  const std::string path = journal(own);
  if (path.empty()) {
    if (!resume) return std::make_unique<Journal>();
    throw UsageError(
        fmt::format("{}: --resume needs --json FILE or --report FILE.html, beside which the "
                    "journal of the earlier run lies",
                    verb));
  }
  const bool there = std::filesystem::exists(path);
  if (there && !resume) {
    warn(
        fmt::format("{} holds parts of an earlier run and is replaced as soon as a part of this "
                    "run is finished; --resume would use them",
                    path));
  }
  auto journal = std::make_unique<Journal>(path, run, resume);
  journal->on_trouble(warn);
  for (const std::string& sentence : journal->warnings()) warn(sentence);
  if (resume && !there) note(fmt::format("there is no {}; everything is computed", path));
  return journal;
}

void check_writable(const std::string& path) {
  if (path.empty()) return;
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
  std::error_code error;
  if (fs::is_directory(path, error))
    throw InputError({path, 0, 0}, "", "cannot write: this is a folder; give a file name");
  if (fs::exists(path, error)) {
    // Devices and FIFOs are written through, whatever their folder allows.
    if (::access(path.c_str(), W_OK) != 0)
      throw InputError({path, 0, 0}, "", "cannot write: no permission to change this file");
    if (!fs::is_regular_file(path, error)) return;
  }
  if (!fs::is_directory(folder, error)) {
    throw InputError(
        {path, 0, 0}, "",
        fmt::format("cannot write: there is no folder {}; create it first", folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    throw InputError({path, 0, 0}, "",
                     fmt::format("cannot write: no permission in {}", folder.string()));
  }
}

bool same_file(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const fs::path whole_a = fs::weakly_canonical(fs::absolute(a, error), error);
  const fs::path whole_b = fs::weakly_canonical(fs::absolute(b, error), error);
  return !whole_a.empty() && whole_a == whole_b;
}

std::vector<NamedFile> named(const std::string& option, const std::vector<std::string>& paths) {
  std::vector<NamedFile> files;
  files.reserve(paths.size());
  for (const std::string& path : paths) files.push_back({option, path});
  return files;
}

void check_outputs_apart(const std::string& verb, const std::vector<NamedFile>& outputs,
                         const std::vector<NamedFile>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i].path.empty()) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (outputs[j].path.empty() || !same_file(outputs[i].path, outputs[j].path)) continue;
      throw UsageError(
          fmt::format("{}: {} and {} name the same file, {}; give each a file of its own", verb,
                      outputs[j].option, outputs[i].option, outputs[i].path));
    }
    for (const NamedFile& input : inputs) {
      if (input.path.empty() || !same_file(outputs[i].path, input.path)) continue;
      throw UsageError(fmt::format("{}: {} would overwrite the input {} (given with {})", verb,
                                   outputs[i].option, input.path, input.option));
    }
  }
}

void Outputs::write_json(const std::string& text) const {
  if (json == kStandardOutput) {
    put_out(text);
  } else {
    write_file_atomically(json, text);
  }
}

CLI::Validator number_from(double lo, double hi) {
  return {[=](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            if (!text.empty() && *end == '\0' && value >= lo && value <= hi) return std::string();
            return fmt::format("got \"{}\", expected a number from {:g} to {:g}", text, lo, hi);
          },
          fmt::format("{:g}..{:g}", lo, hi), "number"};
}

void Outputs::check() const {
  if (json == kStandardOutput) {
    texts_to_stderr();
  } else {
    check_writable(json);
  }
  check_writable(report);
}

}  // namespace sparflow::cli
