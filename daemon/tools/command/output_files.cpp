#include "daemon/tools/command/output_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>

#include <CLI/CLI.hpp>

#include "proto/clip/format.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

namespace fs = std::filesystem;

// Extensions of formats other than clips that posed or other programs recognise.
constexpr std::array<std::string_view, 19> kOtherFormats{
    ".asf",  ".style", ".gesture", ".toml", ".lab",  ".plog", ".svg", ".dot",  ".gv",   ".txt",
    ".json", ".bin",   ".key",     ".pub",  ".mcap", ".png",  ".mp4", ".html", ".jsonl"};

bool is_of_known_format(const fs::path& path) {
  const std::string extension = clip::extension_of(path);
  return clip::format_of(path) != nullptr ||
         std::ranges::find(kOtherFormats, extension) != kOtherFormats.end();
}

// Whether both names are the same file, whether or not it exists already.
bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const fs::path whole_a = fs::weakly_canonical(fs::absolute(a, error), error);
  const fs::path whole_b = fs::weakly_canonical(fs::absolute(b, error), error);
  return !error && whole_a == whole_b;
}

Result<> check_place(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return misuse("is a folder; name a file in it", path.string());
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    return misuse("is not a regular file; name another one to write to", path.string());
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error)) {
    return misuse("its folder is not there; make it, or name another file", path.string());
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    return misuse("its folder cannot be written to; name a file elsewhere", path.string());
  }
  return {};
}

}  // namespace

CLI::Option* add_overwrite_option(CLI::App& command, bool& overwrite) {
  return command.add_flag("--overwrite", overwrite, "Replace files that are there already");
}

CLI::Option* add_report_option(CLI::App& command, std::string& path) {
  return command.add_option("--report", path, "Figures and tables, too, as one HTML page")
      ->type_name("OUT.html");
}

void add_report_file(CLI::App& command, ReportFile& file) {
  auto* report = add_report_option(command, file.path);
  add_overwrite_option(command, file.overwrite)->needs(report);
}

Result<> ReportFile::check() const {
  return OutputFiles(overwrite).writes(path, {".html"}).check();
}

OutputFiles& OutputFiles::reads(const fs::path& path) {
  if (!path.empty()) inputs_.push_back(path);
  return *this;
}

OutputFiles& OutputFiles::writes(const fs::path& path, std::vector<std::string_view> extensions) {
  if (!path.empty()) outputs_.push_back({path, std::move(extensions), true});
  return *this;
}

OutputFiles& OutputFiles::writes_any_but_other(const fs::path& path,
                                               std::vector<std::string_view> extensions) {
  if (!path.empty()) outputs_.push_back({path, std::move(extensions), false});
  return *this;
}

Result<> OutputFiles::check() const {
  for (auto output = outputs_.begin(); output != outputs_.end(); ++output) {
    TRY(check(*output));
    const auto twice = std::any_of(outputs_.begin(), output, [&](const Output& other) {
      return same_file(other.path, output->path);
    });
    if (twice) return misuse("would be written twice; name two files", output->path.string());
  }
  for (const Output& output : outputs_) {
    if (!overwrite_) never_replace(output.path);
  }
  return {};
}

Result<> OutputFiles::check(const Output& output) const {
  const std::string extension = clip::extension_of(output.path);
  const bool right = std::ranges::find(output.extensions, extension) != output.extensions.end();
  const bool other = is_of_known_format(output.path);
  if (!right && (output.strict || other)) {
    // What assimp writes Blender refuses, and posed has no writer of its own.
    const bool takes_glb = std::ranges::find(output.extensions, ".glb") != output.extensions.end();
    if (extension == ".fbx" && takes_glb) {
      return misuse(
          "is FBX, which posed reads but does not write; name a .glb, which Blender, Unity and "
          "Unreal import",
          output.path.string());
    }
    return misuse("does not end in " + alternatives(output.extensions) + "; choose such a name",
                  output.path.string());
  }
  for (const fs::path& input : inputs_) {
    if (same_file(input, output.path)) {
      return misuse("is read by this command; name another file, so that nothing is lost",
                    output.path.string());
    }
  }
  TRY(check_place(output.path));
  std::error_code error;
  if (!overwrite_ && fs::exists(output.path, error)) {
    return misuse("exists already; name another file, or add --overwrite to replace it",
                  output.path.string());
  }
  return {};
}

}  // namespace posed::tools
