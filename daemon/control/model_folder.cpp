#include "daemon/control/model_folder.hpp"

#include <algorithm>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "daemon/control/uploads.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kMaxModels = 256;

// Empty: no model file.
std::string_view kind_of(const std::filesystem::path& file) {
  if (file.extension() == ".style") return "style";
  return file.extension() == ".gesture" ? "generate" : "";
}

}  // namespace

Result<ModelFolder> ModelFolder::open(std::filesystem::path folder) {
  std::error_code ignored;
  if (!folder.empty() && !is_directory(folder, ignored)) {
    return fail(
        "models in [control] names no folder; make it and put models into it, or leave the key out",
        folder.string());
  }
  return ModelFolder(std::move(folder));
}

Result<std::vector<FolderModel>> ModelFolder::list() const {
  std::vector<FolderModel> models;
  if (folder_.empty()) return models;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder_, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    std::error_code ignored;
    const std::string name = entries->path().filename().string();
    const std::string_view kind = kind_of(entries->path());
    // Control characters in a name would reach people's terminals.
    if (kind.empty() || clean(name) != name || !entries->is_regular_file(ignored)) continue;
    models.push_back({.name = name, .kind = kind});
  }
  if (error) {
    return fail("the folder of models cannot be read: " + error.message(), folder_.string());
  }
  std::ranges::sort(models, {}, &FolderModel::name);
  if (models.size() > kMaxModels) models.resize(kMaxModels);
  return models;
}

Result<std::string> ModelFolder::read(std::string_view name) const {
  const auto models = TRY(list());
  if (std::ranges::find(models, name, &FolderModel::name) == models.end()) {
    return fail(fmt::format(
        "there is no model {} in the daemon's list; `posed ctl models` shows it", in_quotes(name)));
  }
  return load_file(folder_ / name, {.what = "model", .max_bytes = kMaxModel});
}

}  // namespace posed::control
