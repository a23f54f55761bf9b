#include "daemon/tools/style/experiment.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "daemon/tools/command/person_clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::tools {
namespace {

constexpr TomlLimits kExperimentLimits{
    .what = "experiment file", .bytes = std::size_t{1024} * 1024, .depth = 4, .items = 20'000};
constexpr std::size_t kMaxClips = 4000;

// A value that must be one of a few words.
template <typename T>
void read_choice(TableReader& reader, const char* key, auto& value,
                 Result<T> (*parse)(std::string_view)) {
  std::string word;
  reader.read(key, word);
  if (word.empty()) return;
  const auto parsed = parse(word);
  if (parsed) {
    value = *parsed;
  } else {
    reader.add_error(key, parsed.error().message);
  }
}

void read_clip_table(TableReader& table, const std::filesystem::path& folder,
                     Experiment& experiment) {
  ExperimentClip clip;
  clip.line = table.line();
  std::string file;
  table.require("file", file);
  table.require("group", clip.group);
  table.require("motion", clip.motion);
  clip.file = folder / file;
  clip.subject = kOnePerson;
  table.read("subject", clip.subject);
  table.read("day", clip.day);
  experiment.clips.push_back(std::move(clip));
}

// A name, or a list of names.
void read_targets(TableReader& reader, std::vector<std::string>& targets) {
  if (!reader.need("target", "give it the name of a group, or a list of names")) return;
  if (!reader.has_text("target")) return reader.read("target", targets);
  reader.read("target", targets.emplace_back());
}

void read_tables(const toml::table& root, const std::filesystem::path& folder,
                 posed::Findings& findings, Experiment& experiment) {
  TableReader reader(root, "", findings);
  read_targets(reader, experiment.targets);
  reader.read("rate_hz", experiment.rate_hz, {10.0, 1000.0});
  read_choice(reader, "pose_space", experiment.space, motion::space_from_name);
  read_choice(reader, "mode", experiment.mode, style::mode_from_name);
  std::string asf;
  reader.read("skeleton", asf);
  if (!asf.empty()) experiment.asf = folder / asf;
  auto clips = reader.tables("clip", kMaxClips);
  for (TableReader& clip : clips) {
    read_clip_table(clip, folder, experiment);
    clip.finish();
  }
  if (experiment.targets.empty() && findings.errors.empty()) {
    reader.add_error("target", "target is an empty list; name the groups whose styles to learn");
  }
  if (clips.empty() && findings.errors.empty()) {
    findings.add_error(1, "the experiment names no [[clip]]; list the clips to learn from");
  }
  reader.finish();
}

}  // namespace

Result<Experiment> read_experiment(const std::filesystem::path& path) {
  const auto root = load_toml(path, kExperimentLimits);
  if (!root) return misuse(root.error().message, root.error().file, root.error().line);
  posed::Findings findings{.file = path.string(), .exit_code = ExitCode::kWrongUse};
  Experiment experiment;
  read_tables(*root, path.parent_path(), findings, experiment);
  return findings.result(std::move(experiment));
}

ExperimentClip named_clip(const std::string& argument, const std::string& group,
                          const std::string& motion) {
  auto [person, file] = person_clip(argument);
  if (person.empty()) person = kOnePerson;
  return {std::move(file), group, std::move(person), motion, 0};
}

namespace {

// NAME=REST apart, where no file has the whole name and the part before the first '=' holds no '/',
// which only a file's name does.
std::optional<std::pair<std::string, std::string>> name_apart(const std::string& argument) {
  const auto equals = argument.find('=');
  std::error_code ignored;
  if (equals == std::string::npos || equals == 0 || std::filesystem::exists(argument, ignored) ||
      argument.substr(0, equals).contains('/')) {
    return std::nullopt;
  }
  return std::pair(argument.substr(0, equals), argument.substr(equals + 1));
}

}  // namespace

Result<> add_days(const std::vector<std::string>& arguments, Experiment& experiment) {
  std::string day = "first";
  for (const std::string& argument : arguments) {
    const auto named = name_apart(argument);
    if (named) day = named->first;
    const std::filesystem::path file = named ? named->second : argument;
    bool found = false;
    for (ExperimentClip& clip : experiment.clips) {
      if (clip.file != file) continue;
      clip.day = day;
      found = true;
    }
    if (found) continue;
    return misuse("this file of --day is no clip of --from or --to; name it there as well",
                  file.string());
  }
  return {};
}

Result<> add_target_clips(const std::vector<std::string>& arguments, const std::string& motion,
                          Experiment& experiment) {
  std::string group;
  for (const std::string& argument : arguments) {
    const auto named = name_apart(argument);
    if (named) group = named->first;
    experiment.clips.push_back(named_clip(named ? named->second : argument, group, motion));
    if (named && std::ranges::find(experiment.targets, group) == experiment.targets.end()) {
      experiment.targets.push_back(group);
    }
  }
  if (experiment.targets.empty()) {
    experiment.targets.emplace_back("to");
    for (ExperimentClip& clip : experiment.clips) {
      if (clip.group.empty()) clip.group = "to";
    }
    return {};
  }
  for (const ExperimentClip& clip : experiment.clips) {
    if (!clip.group.empty()) continue;
    return misuse(
        "this clip of --to stands before the first NAME=; say which style it shows, as in"
        " --to feminine=a.bvh elderly=b.bvh",
        clip.file.string());
  }
  return {};
}

Result<std::vector<style::TrainingClip>> load_clips(const Experiment& experiment) {
  std::vector<style::TrainingClip> clips;
  for (const ExperimentClip& entry : experiment.clips) {
    auto clip = TRY(clip::read_clip(
        entry.file, clip::accepted_options(entry.file, {.skeleton = experiment.asf})));
    clips.push_back({std::move(clip), entry.group, entry.subject, entry.motion, entry.day});
  }
  return clips;
}

}  // namespace posed::tools
