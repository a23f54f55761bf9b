// `posed models`: what model files are, whom they know and how good they are.
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/control/model_folder.hpp"
#include "daemon/control/model_words.hpp"
#include "daemon/control/uploads.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::tools {
namespace {

struct ModelsOptions {
  std::vector<std::filesystem::path> paths{"."};
  bool json = false;
};

// The models of a folder, in its order; the file itself otherwise.
Result<std::vector<std::filesystem::path>> model_files_at(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return std::vector{path};
  const auto folder = TRY(control::ModelFolder::open(path));
  std::vector<std::filesystem::path> files;
  const auto models = TRY(folder.list());
  for (const control::FolderModel& model : models) files.push_back(path / model.name);
  return files;
}

Result<> list_models_at(const ModelsOptions& options) {
  std::vector<Findings> models;
  for (const std::filesystem::path& path : options.paths) {
    const auto files = TRY(model_files_at(path));
    if (files.empty()) {
      return fail("no model is here: a model is a .style or a .gesture", path.string());
    }
    for (const std::filesystem::path& file : files) {
      const auto bytes = TRY(load_file(file, {.what = "model", .max_bytes = control::kMaxModel}));
      const std::string_view kind = file.extension() == ".gesture" ? "generate" : "style";
      const auto words = control::words_of_model(bytes, kind, file.filename().string());
      models.push_back(Findings()
                           .add("file", file.string())
                           .add("stage", kind)
                           .add("learnt", words.learnt)
                           .add("skeleton", words.skeleton)
                           .add("verdict", words.verdict)
                           .add("strip", words.strip));
      models.back().say(clean(file.string()));
      for (const auto& [what, text] : {std::pair{"learnt", words.learnt},
                                       {"skeleton", words.skeleton},
                                       {"verdict", words.verdict}}) {
        if (!text.empty()) models.back().say(fmt::format("  {:<9} {}", what, text));
      }
    }
  }
  Findings().add("models", models).show(options.json);
  return {};
}

}  // namespace

void add_models(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("models", "Tell what model files were learnt from");
  auto options = std::make_shared<ModelsOptions>();
  command->add_option("paths", options->paths, "Files, and folders with .style and .gesture files")
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print it as JSON");
  command->footer(R"(Examples:
  posed models models                    # everything in the folder
  posed models walk-to-sneak.style
What a running daemon has in its own folder: `posed ctl models`.)");
  command->callback([options, &exit_code] { exit_code = report(list_models_at(*options)); });
}

}  // namespace posed::tools
