#pragma once
/// What every verb returns to Python: the JSON of `--json`, the text of the terminal and the page of `--report`.
#include <string>

#include "apps/report/page/page.h"

namespace sparflow::python {

class Result {
 public:
  Result() = default;
  Result(const Result&) = delete;
  Result& operator=(const Result&) = delete;
  virtual ~Result() = default;
  virtual std::string json() const = 0;
  virtual std::string text() const = 0;      ///< one screen
  virtual std::string headline() const = 0;  ///< one sentence
  virtual Page page() const = 0;
};

}  // namespace sparflow::python
