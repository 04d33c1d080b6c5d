#pragma once
/// A machine file in which values that nobody knows are left open by the word `unknown` (docs/machine_from_log.md), and the
/// text of the file with values in their place.
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/error.h"

namespace sparflow {

/// What an open value is.
enum class OpenKind {
  kMass,           ///< of a link [kg]
  kCog,            ///< of a link [m]
  kBore,           ///< of a cylinder [m]
  kRod,            ///< of a cylinder, diameter [m]
  kZeroLength,     ///< `length_at_zero_stroke` of a cylinder [m]
  kBarrelPin,      ///< `barrel.xyz` of a linkage [m]
  kRodPin,         ///< `rod.xyz` of a linkage [m]
  kRockerPin,      ///< `rocker.xyz` of a four-bar [m]
  kCouplerPin,     ///< `coupler.xyz` of a four-bar [m]
  kRockerLength,   ///< [m]
  kCouplerLength,  ///< [m]
  kRadius          ///< of a rack [m]
};

/// One `unknown` of the file.
struct OpenValue {
  OpenKind kind = OpenKind::kMass;
  int part = 0;            ///< index of the link (mass, cog) or cylinder
  std::string path;        ///< "cylinders[boom].bore"
  FilePlace place;         ///< in the file
  std::size_t begin = 0;   ///< of the word in the file's text
  std::size_t length = 0;  ///< of the word, quotes included
};

/// A machine file with open values. The machine has placeholders in their places and is not checked as a whole.
struct MachineSketch {
  std::string text;    ///< as read
  std::string file;    ///< name in messages
  std::string folder;  ///< base of relative paths in it
  Machine machine;
  std::vector<Eigen::Isometry3d>
      file_frames;              ///< by joint: pose of the file's frame in the frame at the joint
  std::vector<OpenValue> open;  ///< in the order of the file's text

  /// @return nullptr when that value is given
  const OpenValue* find(OpenKind kind, int part) const;
  bool is_open(OpenKind kind, int part) const { return find(kind, part) != nullptr; }
  /// Whether anything of a cylinder's linkage or its length at zero stroke is open.
  bool linkage_open(int cylinder) const;
};

/// @throws InputError as load_machine, and for an `unknown` where no value can be left open
MachineSketch load_sketch(const std::string& path);
/// The same from text. @param name of the text in messages  @param folder base of relative paths in it
MachineSketch parse_sketch(const std::string& text, const std::string& name,
                           const std::string& folder);

/// A value for an open place, as YAML ("0.1234", "[0.4, 0, 0.5]"); empty: it stays open.
struct Completion {
  std::string value;
  std::string remark;  ///< comment before the line of the value; may be empty
};

/// The sketch's text with these values in the places of its open ones; all else stays as it is.
/// @param completions one for each open value, in their order  @param heading lines of comment for the head of the file
std::string completed_text(const MachineSketch& sketch, const std::vector<Completion>& completions,
                           const std::vector<std::string>& heading);

}  // namespace sparflow
