#include <fmt/format.h>

#include <algorithm>

#include "apps/python/bindings.h"
#include "apps/python/long_call.h"
#include "apps/python/result.h"
#include "apps/report/model_pages/proposal_page.h"
#include "identification/mapping_proposal/channel_file.h"
#include "models/files/model_file.h"

namespace sparflow::python {
namespace {

/// Channels of a log and which of a machine's signals each is proposed to be.
class Proposed final : public Result {
 public:
  Proposed(TimedChannels file, Machine machine, const ProposalOptions& options)
      : file_(std::move(file)),
        machine_(std::move(machine)),
        channels_(summaries(file_)),
        proposal_(propose_mapping(file_, machine_, options)) {}
  std::string json() const override {
    return channels_json(file_, channels_, {}, proposal_json(proposal_, machine_));
  }
  std::string text() const override {
    return fmt::format("{}: {}; {} channels\n  {}\n{}{}", file_.recording.file,
                       file_.recording.format, channels_.size(), file_.clock_reason,
                       summary_table(channels_), proposal_table(proposal_, machine_));
  }
  std::string headline() const override {
    const auto sure = std::count_if(proposal_.meanings.begin(), proposal_.meanings.end(),
                                    [&](const MeaningProposal& m) { return proposal_.sure(m); });
    return fmt::format("{}: {} channels; {} of {} signals of {} have one for sure",
                       file_.recording.file, channels_.size(), sure, proposal_.meanings.size(),
                       machine_.name);
  }
  Page page() const override { return proposal_page(proposal_, machine_, file_.recording.file); }
  std::string yaml() const { return mapping_yaml(proposal_, machine_); }

 private:
  TimedChannels file_;
  Machine machine_;
  std::vector<ChannelSummary> channels_;
  MappingProposal proposal_;
};

std::shared_ptr<Proposed> propose(const std::string& path, const Machine& machine,
                                  const py::dict& a) {
  ChannelFileOptions reading;
  reading.mapping_file = a["mapping"].cast<std::string>();
  reading.dbc_files = a["dbc"].cast<std::vector<std::string>>();
  return long_call<Proposed>(a["progress"], [path, machine, reading](const Listener& listener) {
    const WorkProgress asked = progress_or_stop(listener);
    asked(0.0, "reading " + path);
    TimedChannels file = read_timed_channels(path, reading);
    for (const std::string& w : file.recording.warnings) listener.say_warning(w);
    ProposalOptions options;
    options.progress = [asked, &machine] { asked(0.5, "proposing a mapping for " + machine.name); };
    return std::make_shared<Proposed>(std::move(file), machine, options);
  });
}

}  // namespace

void bind_mapping(py::module_& m) {
  py::class_<Proposed, Result, std::shared_ptr<Proposed>>(
      m, "MappingProposal",
      "What propose_mapping() gives: the channels of a log, and which of a machine's signals each "
      "is.")
      .def_property_readonly("yaml", &Proposed::yaml,
                             "Text of the proposed mapping file; what is unsure stands in it as "
                             "comments.")
      .def(
          "save",
          [](const Proposed& p, const py::object& path) {
            write_file_atomically(path_from(path), p.yaml());
          },
          py::arg("path"),
          "Writes the proposed mapping file for `mapping=` of Log.load and fit; look through it "
          "first.");
  m.def("propose_mapping", [](const py::object& path, const Machine& machine, const py::dict& a) {
    return propose(path_from(path), machine, a);
  });
}

}  // namespace sparflow::python
