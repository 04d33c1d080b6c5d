// `sparflow completion`: what bash offers after words of the command line, and scripts that each shell can read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
namespace fs = std::filesystem;

std::string printed(const std::string& command) {
  std::string out;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return out;
  std::array<char, 4096> part{};
  for (std::size_t n = 0; (n = std::fread(part.data(), 1, part.size(), pipe)) > 0;) {
    out.append(part.data(), n);
  }
  ::pclose(pipe);
  return out;
}

const std::string kProgram = std::string(SPARFLOW_BINARY_DIR) + "/sparflow";

struct Completion : ::testing::Test {
  fs::path folder =
      fs::temp_directory_path() / ("sparflow_completion_" + std::to_string(::getpid()));
  Completion() {
    fs::create_directories(folder);
    std::ofstream(folder / "a log.csv") << "t_s\n";
  }
  ~Completion() override { fs::remove_all(folder); }

  /// What bash offers when the last of the words is being typed.
  std::vector<std::string> offered(const std::vector<std::string>& words) const {
    std::ofstream script(folder / "ask.bash");
    script << printed(kProgram + " completion bash") << "cd '" << folder.string()
           << "'\nCOMP_WORDS=(";
    for (const std::string& word : words) script << " '" << word << "'";
    script << ")\nCOMP_CWORD=" << words.size() - 1
           << "\n_sparflow\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
    script.close();
    std::istringstream lines(printed("bash --norc " + (folder / "ask.bash").string() + " 2>&1"));
    std::vector<std::string> out;
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty()) out.push_back(line);
    }
    return out;
  }
};

TEST_F(Completion, OffersVerbsOptionsValuesAndFiles) {
  EXPECT_EQ(offered({"sparflow", "di"}), std::vector<std::string>{"diagnose"});
  EXPECT_THAT(offered({"sparflow", ""}), Contains("optimize"));
  EXPECT_EQ(offered({"sparflow", "fit", "--mach"}), std::vector<std::string>{"--machine"});
  EXPECT_EQ(offered({"sparflow", "fit", "--log", "a "}), std::vector<std::string>{"a log.csv"});
  EXPECT_EQ(offered({"sparflow", "simulate", "--programme", "op"}),
            std::vector<std::string>{"operator"});
  EXPECT_EQ(offered({"sparflow", "simulate", "--programme", "=", "cy"}),
            std::vector<std::string>{"cycles"});
  EXPECT_EQ(offered({"sparflow", "effects", "coulomb"}),
            std::vector<std::string>{"coulomb_friction"});
  EXPECT_EQ(offered({"sparflow", "help", "par"}), std::vector<std::string>{"pareto"});
  EXPECT_EQ(offered({"sparflow", "completion", ""}),
            (std::vector<std::string>{"bash", "zsh", "fish"}));
}

TEST_F(Completion, FilesAreOfferedByEndingWhereThereAreSuch) {
  fs::create_directories(folder / "machines");
  for (const char* name : {"crane.yaml", "crane.json", "bus.dbc", "drive.mf4"})
    std::ofstream(folder / name) << "\n";
  EXPECT_THAT(offered({"sparflow", "fit", "--machine", ""}),
              UnorderedElementsAre("crane.yaml", "machines"));
  EXPECT_THAT(offered({"sparflow", "compare", "--model", "cr"}),
              UnorderedElementsAre("crane.json"));
  EXPECT_THAT(offered({"sparflow", "fit", "--log", ""}),
              UnorderedElementsAre("a log.csv", "drive.mf4", "machines"));
  EXPECT_THAT(offered({"sparflow", "log", "--dbc", ""}),
              UnorderedElementsAre("bus.dbc", "machines"));
  EXPECT_THAT(offered({"sparflow", "log", ""}),
              UnorderedElementsAre("a log.csv", "drive.mf4", "machines"));
  // no machine file begins so
  EXPECT_THAT(offered({"sparflow", "fit", "--machine", "a"}), Contains("a log.csv"));
}

TEST_F(Completion, NamesOfRegistriesAreOfferedAlsoBehindAComma) {
  EXPECT_EQ(offered({"sparflow", "benchmark", "--controllers", "joint"}),
            std::vector<std::string>{"joint_pi"});
  EXPECT_EQ(offered({"sparflow", "benchmark", "--controllers", "tip_rate,joint"}),
            std::vector<std::string>{"tip_rate,joint_pi"});
  EXPECT_THAT(offered({"sparflow", "simulate", "--effects", "no"}), Contains("none"));
  EXPECT_THAT(offered({"sparflow", "extend", "--add", "coul"}), Contains("coulomb_friction"));
}

TEST_F(Completion, AValueThatIsANumberOffersNoFile) {
  EXPECT_THAT(offered({"sparflow", "fit", "--threads", ""}), IsEmpty());
  EXPECT_THAT(offered({"sparflow", "fit", "-l", ""}), Contains("a log.csv"));
}

TEST_F(Completion, EveryVerbOfTheHelpIsOffered) {
  std::istringstream help(printed(kProgram + " --help"));
  const std::vector<std::string> verbs = offered({"sparflow", ""});
  bool listed = false;
  int seen = 0;
  for (std::string line; std::getline(help, line);) {
    if (line == "Subcommands:") {
      listed = true;
    } else if (listed && line.empty()) {
      break;
    } else if (listed && line.rfind("  ", 0) == 0 && line[2] != ' ') {
      EXPECT_THAT(verbs, Contains(line.substr(2, line.find(' ', 2) - 2)));
      ++seen;
    }
  }
  EXPECT_GT(seen, 15);
}

TEST_F(Completion, ScriptsAreWhatTheirShellsRead) {
  std::ofstream(folder / "sparflow.bash") << printed(kProgram + " completion bash");
  EXPECT_EQ(printed("bash -n " + (folder / "sparflow.bash").string() + " 2>&1"), "");
  const std::string zsh = printed(kProgram + " completion zsh");
  EXPECT_THAT(zsh, HasSubstr("#compdef sparflow\n"));
  // brackets and colons inside a description would end it
  EXPECT_THAT(zsh, HasSubstr("'*--seconds[time for the path search \\[s\\]]:value: '"));
  const std::string fish = printed(kProgram + " completion fish");
  EXPECT_THAT(fish, HasSubstr("-s m -l machine -r -d 'machine file (YAML)'"));
  EXPECT_THAT(printed(kProgram + " completion tcsh 2>&1; echo $?"), HasSubstr("2"));
}

}  // namespace
