#pragma once
/// Opens a page of the program in headless chromium and reports what was drawn and which errors occurred.
#include <string>
#include <vector>

namespace sparflow::test_support {

struct BrowserReport {
  bool available =
      false;  ///< false: there is no chromium on this machine, and the other members are not set
  int plots_expected =
      -1;                ///< figures that the page was built with; -1 = not a page of the program
  int plots_drawn = -1;  ///< figures that have a visible pixel or an SVG with content
  std::vector<std::string> errors;  ///< script errors, console errors, refused network requests
  std::string dom;                  ///< the document after its scripts ran

  bool good() const { return available && plots_expected == plots_drawn && errors.empty(); }
  /// Returns the value of a data attribute of <body> with entities decoded, "" when there is none.
  std::string body_data(const std::string& name) const;
};

/// @param path an HTML file; @param options further command-line switches of chromium
/// Use: `const auto report = check_page(path); if (!report.available) GTEST_SKIP() << "no chromium";`
BrowserReport check_page(const std::string& path, const std::string& options = "");

}  // namespace sparflow::test_support
