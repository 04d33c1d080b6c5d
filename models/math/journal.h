#pragma once
/// The finished parts of a long run, on disk as soon as each is complete, so that a run that was ended can be resumed.
///
/// The file holds lines of JSON: {"journal": 1, "run": SHA-256 of inputs and options}, then one line a finished part:
/// {"part": name, "sha256": of name and bytes, "hex": the bytes}. A line is written whole, flushed to disk, and never
/// changed afterwards.
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace sparflow {

class Journal {
 public:
  /// A journal that keeps nothing.
  Journal() = default;
  /// @param path the journal's file; nothing is written before the first part is finished
  /// @param run identifies inputs, options and program
  /// @param resume whether parts are read that an earlier run of the same `run` has finished; where the file is missing
  ///        there are none
  /// @throws InputError for a journal of another run, or a file that is no journal
  Journal(std::string path, std::string run, bool resume);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// The bytes of a finished part, or null.
  const std::string* find(const std::string& part) const;
  /// Number of parts that were read.
  std::size_t finished() const { return parts_.size(); }
  /// Sentences on lines that were left out because they are torn or damaged.
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// Writes a finished part, whose name is UTF-8; returns when it is on disk.
  /// @throws InputError where that fails, or another run writes the same journal; what was written before stays
  void add(const std::string& part, const std::string& bytes);
  /// A part's result as it is computed.
  struct Part {
    std::string bytes;
    bool complete = true;  ///< false: it was interrupted, and is not kept
  };
  /// The bytes of a part: those of an earlier run, else those computed now, which are kept. A journal that cannot be written
  /// is no reason to end the work: on_trouble gets the sentence. Threads may ask for different parts at once.
  std::string kept(const std::string& part, const std::function<Part()>& compute);
  /// Keeps a finished part as `kept` does.
  void keep(const std::string& part, const std::string& bytes);
  /// Sets what is told when the journal cannot be written.
  void on_trouble(std::function<void(const std::string&)> tell) { trouble_ = std::move(tell); }
  /// Deletes the file after a complete run.
  void remove();

 private:
  void read();
  void read_line(const std::string& line, int number);
  void lock();
  void begin();

  std::string path_, run_;
  std::mutex writing_;
  std::function<void(const std::string&)> trouble_;
  std::map<std::string, std::string> parts_;
  std::vector<std::string> warnings_;
  bool resume_ = false;
  bool begun_ = false;  ///< whether the file has its first line and takes parts
  long whole_ = 0;      ///< length of the file up to the end of its last whole line [bytes]
  int fd_ = -1;
};

/// Identifies a run: SHA-256 of this program, of the files' names and contents, and of the options in words.
/// @throws InputError for a file that cannot be read
std::string run_fingerprint(const std::vector<std::string>& files, const std::string& options);

}  // namespace sparflow
