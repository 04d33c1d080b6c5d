#pragma once
/// Opens a page of ours in headless chromium and tells what became of it.
#include <string>
#include <vector>

namespace sparflow::test_support {

struct BrowserReport {
  bool available = false;           ///< false: no chromium on this machine, nothing else is filled
  int plots_expected = -1;          ///< figures the page was built with; -1 = not a page of ours
  int plots_drawn = -1;             ///< figures that have ink
  std::vector<std::string> errors;  ///< script errors, console errors, refused network requests
  std::string dom;                  ///< the document after its scripts ran

  bool good() const { return available && plots_expected == plots_drawn && errors.empty(); }
  /// The value of a data attribute of <body>, "" when there is none; entities are decoded.
  std::string body_data(const std::string& name) const;
};

/// @param path an HTML file; @param options further command-line switches of chromium
/// Use: `const auto report = check_page(path); if (!report.available) GTEST_SKIP() << "no chromium";`
BrowserReport check_page(const std::string& path, const std::string& options = "");

}  // namespace sparflow::test_support
