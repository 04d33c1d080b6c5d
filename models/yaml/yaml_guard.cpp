#include "models/yaml/yaml_guard.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <sstream>
#include <vector>

#include "models/math/door.h"

namespace sparflow {
namespace {

class OutlineEvents : public YAML::EventHandler {
 public:
  explicit OutlineEvents(const std::string& file) : file_(file) {}

  YamlOutline outline;

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++ == 0) return;
    outline.second = true;
    outline.second_place = place(mark);
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(mark, anchor, 1); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string&) override {
    add(mark, anchor, 1);
    outline.empty = false;
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    for (const Open& open : open_) {
      if (open.anchor == anchor) fail(mark, "repeats a value inside itself; remove the alias (*)");
    }
    const auto known = sizes_.find(anchor);
    add(mark, 0, known == sizes_.end() ? 1 : known->second);
    outline.empty = false;
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, anchor);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(mark, anchor);
  }
  void OnMapEnd() override { end(); }

 private:
  struct Open {
    YAML::anchor_t anchor = 0;
    std::int64_t before = 0;  ///< values read before it began
  };

  FilePlace place(const YAML::Mark& mark) const {
    return mark.is_null() ? FilePlace{file_, 0, 0}
                          : FilePlace{file_, mark.line + 1, mark.column + 1};
  }
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& message) const {
    throw InputError(place(mark), "", message);
  }

  void begin(const YAML::Mark& mark, YAML::anchor_t anchor) {
    outline.empty = false;
    open_.push_back({anchor, values_});
    add(mark, 0, 1);
    if (static_cast<int>(open_.size()) > limits_.nesting) {
      fail(mark, fmt::format("nested more than {} deep; is this the right file?", limits_.nesting));
    }
  }
  void end() {
    if (open_.back().anchor != 0) sizes_[open_.back().anchor] = values_ - open_.back().before;
    open_.pop_back();
  }
  void add(const YAML::Mark& mark, YAML::anchor_t anchor, std::int64_t count) {
    if (outline.second && !second_seen_) outline.second_place = place(mark);
    second_seen_ = outline.second;
    values_ += count;
    if (anchor != 0) sizes_[anchor] = count;
    if (values_ > limits_.yaml_values) {
      fail(mark,
           fmt::format("more than {} values up to here (aliases count as what they repeat); is "
                       "this the right file?",
                       limits_.yaml_values));
    }
  }

  const std::string& file_;
  const DoorLimits limits_;
  int documents_ = 0;
  bool second_seen_ = false;  ///< the first value of the second document was met
  std::int64_t values_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, std::int64_t> sizes_;  ///< values that an alias to the anchor repeats
};

}  // namespace

YamlOutline yaml_outline(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  OutlineEvents events(file);
  while (!events.outline.second && parser.HandleNextDocument(events)) {
  }
  return events.outline;
}

}  // namespace sparflow
