#include "daemon/control/model_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config.hpp"
#include "daemon/control/uploads.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kMaxModels = 256;
constexpr std::string_view kStyle = "style";
constexpr std::string_view kGenerate = "generate";

// The ending of the files of a kind.
std::string_view ending_of(std::string_view kind) {
  if (kind == kCalibration) return ".toml";
  return kind == kGenerate ? ".gesture" : ".style";
}

// How many files of all kinds are there, as far as it can be read; counted to the limit.
std::size_t kept_files(const std::filesystem::path& folder) {
  std::size_t count = 0;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::string ending = entries->path().extension().string();
    for (const std::string_view kind : {kStyle, kGenerate, kCalibration}) {
      if (ending == ending_of(kind)) ++count;
    }
    if (count >= kMaxModels) break;
  }
  return count;
}

// Empty: no model file.
std::string_view kind_of(const std::filesystem::path& file) {
  for (const std::string_view kind : {kStyle, kGenerate}) {
    if (file.extension() == ending_of(kind)) return kind;
  }
  return "";
}

// Empty: no model file.
std::optional<FolderModel> model_at(const std::filesystem::directory_entry& entry) {
  std::error_code ignored;
  const std::string name = entry.path().filename().string();
  const std::string_view kind = kind_of(entry.path());
  // Control characters in a name would reach people's terminals.
  if (kind.empty() || clean(name) != name || !entry.is_regular_file(ignored)) return std::nullopt;
  const auto changed = entry.last_write_time(ignored).time_since_epoch().count();
  return FolderModel{
      .name = name, .kind = kind, .stamp = fmt::format("{} {}", changed, entry.file_size(ignored))};
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
    // Of a folder of very many files only those that are listed are looked at and kept.
    const std::string name = entries->path().filename().string();
    if (models.size() == kMaxModels && name >= models.back().name) continue;
    auto model = model_at(*entries);
    if (!model) continue;
    models.insert(std::ranges::upper_bound(models, name, {}, &FolderModel::name),
                  std::move(*model));
    if (models.size() > kMaxModels) models.pop_back();
  }
  if (error) {
    return fail("the folder of models cannot be read: " + error.message(), folder_.string());
  }
  return models;
}

Result<> ModelFolder::check_writable() const {
  if (folder_.empty()) {
    return fail(
        "the daemon has no folder to keep a model in: name one in its config ([control] models ="
        " \"models\") and start again");
  }
  if (access(folder_.c_str(), W_OK) == 0) return {};
  return fail("the daemon may not write into the folder of models; let its user do so",
              folder_.string());
}

Result<std::string> ModelFolder::add(const std::string& name, std::string_view kind,
                                     std::string_view bytes) const {
  TRY(check_writable());
  if (kept_files(folder_) >= kMaxModels) {
    return fail("the folder of models is full; move some of its models elsewhere",
                folder_.string());
  }
  // Another daemon with this folder may be keeping one of this name just now.
  const std::filesystem::path whole =
      folder_ / fmt::format(".{}{}.{}.new", name, ending_of(kind), getpid());
  TRY(write_whole_file(whole, bytes));
  for (std::size_t number = 1; number <= kMaxModels + 1; ++number) {
    const std::string file =
        name + (number == 1 ? "" : "-" + std::to_string(number)) + std::string(ending_of(kind));
    if (rename_to_new(whole, folder_ / file)) return file;
    if (errno != EEXIST) break;
  }
  std::error_code error(errno, std::generic_category());
  std::error_code ignored;
  std::filesystem::remove(whole, ignored);
  return fail("the model cannot be kept: " + error.message(), folder_.string());
}

// Without the list: of a folder of many files it would be made for every model.
Result<FolderModel> ModelFolder::find(std::string_view name) const {
  const std::filesystem::path file(name);
  std::error_code ignored;
  if (!folder_.empty() && file.filename() == file) {
    if (auto found = model_at(std::filesystem::directory_entry(folder_ / file, ignored))) {
      return std::move(*found);
    }
  }
  return fail(fmt::format("there is no model {} in the daemon's list; `posed ctl models` shows it",
                          in_quotes(name)));
}

Result<std::string> ModelFolder::rename(std::string_view name, const std::string& to) const {
  TRY(check_writable());
  const auto model = TRY(find(name));
  if (!config::is_stream_name(to)) {
    return misuse("a model's name has 1 to 32 of a-z, digits, '-' and '_', and no ending");
  }
  const std::string file = to + std::filesystem::path(model.name).extension().string();
  if (rename_to_new(folder_ / model.name, folder_ / file)) return file;
  if (errno == EEXIST) return fail("there is a model " + in_quotes(file) + " already");
  return fail("the model cannot be renamed: " + errno_text(), folder_.string());
}

Result<> ModelFolder::remove(std::string_view name) const {
  TRY(check_writable());
  const auto model = TRY(find(name));
  std::error_code error;
  if (std::filesystem::remove(folder_ / model.name, error)) return {};
  return fail("the model cannot be deleted: " + error.message(), folder_.string());
}

Result<std::string> ModelFolder::read(std::string_view name) const {
  const auto model = TRY(find(name));
  return load_file(folder_ / model.name, {.what = "model", .max_bytes = kMaxModel});
}

}  // namespace posed::control
