// ModelFolder: the models that a client may choose by name. Nothing from the network names a path:
// a name counts only if it is exactly one of the list.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::control {

// The kind of a calibration, which lies beside the models but is none of their list.
inline constexpr std::string_view kCalibration = "calibration";

struct FolderModel {
  std::string name;       // of the file
  std::string_view kind;  // the stage that uses it, as the name's ending says: "style", "generate"
  std::string stamp{};    // another one when the file has changed
};

// Reads the folder at each call, so that models may come and go. Any thread; cold.
class ModelFolder {
 public:
  ModelFolder() = default;  // no folder: the list is empty
  // Says so when `folder`, unless it is empty, is not a folder.
  static Result<ModelFolder> open(std::filesystem::path folder);

  // Regular files that end in .style or .gesture, by name; the first 256.
  Result<std::vector<FolderModel>> list() const;
  // Whether add() can work.
  Result<> check_writable() const;
  // Keeps a model or a calibration under this name and the ending of its kind, with a number
  // between them if there is one of this name: nothing is ever replaced. Returns the file's name.
  // `name` is one of a stream (config::is_stream_name()).
  Result<std::string> add(const std::string& name, std::string_view kind,
                          std::string_view bytes) const;
  // Gives a model of the list the name `to`, one of a stream, and its own ending. Never replaces a
  // file. Returns the file's new name.
  Result<std::string> rename(std::string_view name, const std::string& to) const;
  // Deletes a model of the list.
  Result<> remove(std::string_view name) const;
  // A model of the list, as it is now.
  Result<FolderModel> find(std::string_view name) const;
  // The bytes of a model of the list.
  Result<std::string> read(std::string_view name) const;

 private:
  explicit ModelFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
};

}  // namespace posed::control
