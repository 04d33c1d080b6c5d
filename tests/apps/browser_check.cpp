#include "tests/apps/browser_check.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cctype>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "models/math/error.h"
#include "tests/parsed_json.h"

namespace sparflow::test_support {
namespace {

namespace fs = std::filesystem;

std::string find_chromium() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
      if (fs::exists(fs::path(folder) / name)) return (fs::path(folder) / name).string();
    }
  }
  return "";
}

std::string file_url(const std::string& path) {
  std::string url = "file://";
  for (const char c : fs::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '-' || c == '_' || c == '.') {
      url += c;
    } else {
      url += fmt::format("%{:02X}", byte);
    }
  }
  return url;
}

std::string decoded(std::string text) {
  const std::pair<const char*, const char*> entities[] = {
      {"&quot;", "\""}, {"&lt;", "<"}, {"&gt;", ">"}, {"&#39;", "'"}, {"&amp;", "&"}};
  for (const auto& [entity, plain] : entities) {
    for (std::size_t at = text.find(entity); at != std::string::npos;
         at = text.find(entity, at + 1)) {
      text.replace(at, std::string(entity).size(), plain);
    }
  }
  return text;
}

int as_count(const std::string& text) { return text.empty() ? -1 : std::stoi(text); }

}  // namespace

std::string BrowserReport::body_data(const std::string& name) const {
  const std::size_t body = dom.find("<body");
  if (body == std::string::npos) return "";
  const std::string tag = dom.substr(body, dom.find('>', body) - body);
  const std::string key = " data-" + name + "=\"";
  const std::size_t at = tag.find(key);
  if (at == std::string::npos) return "";
  const std::size_t from = at + key.size();
  return decoded(tag.substr(from, tag.find('"', from) - from));
}

BrowserReport check_page(const std::string& path, const std::string& options) {
  BrowserReport report;
  const std::string chromium = find_chromium();
  if (chromium.empty()) return report;
  report.available = true;

  std::string scratch = (fs::temp_directory_path() / "sparflow-page-XXXXXX").string();
  SPARFLOW_CHECK(::mkdtemp(scratch.data()) != nullptr, "cannot make a folder for the browser");
  // With virtual time, timers run at once, so that the page's own report exists when the document is written.
  const std::string command = fmt::format(
      "timeout -k 5 120 '{0}' --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking --disable-component-update --disable-sync "
      "--disable-dev-shm-usage "
      "--hide-scrollbars --user-data-dir='{1}/profile' --enable-logging=stderr --log-level=0 "
      "--virtual-time-budget=3000 --window-size=1400,1200 {2} --dump-dom '{3}' "
      ">'{1}/dom' 2>'{1}/log' </dev/null",
      chromium, scratch, options, file_url(path));
  const int status = std::system(command.c_str());
  report.dom = read_file(scratch + "/dom");
  std::istringstream log(read_file(scratch + "/log"));
  fs::remove_all(scratch);
  if (status != 0) report.errors.push_back(fmt::format("the browser ended with status {}", status));
  for (std::string line; std::getline(log, line);) {
    if (line.find("CONSOLE") != std::string::npos) report.errors.push_back(line);
  }
  report.plots_expected = as_count(report.body_data("plots-expected"));
  report.plots_drawn = as_count(report.body_data("plots-drawn"));
  const std::string errors = report.body_data("errors");
  if (errors.empty()) {
    report.errors.emplace_back("the page's scripts did not run to their end");
  } else {
    for (const auto& error : test_support::parsed_json(errors)) report.errors.push_back(error);
  }
  return report;
}

}  // namespace sparflow::test_support
