#include "daemon/tools/gesture/question_file.hpp"

#include <algorithm>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "models/gesture/body_recording.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::tools {
namespace {

constexpr TomlLimits kQuestionLimits{
    .what = "questions file", .bytes = std::size_t{256} * 1024, .depth = 4, .items = 16384};
constexpr const char* kNamed = "named";
constexpr const char* kJoints = "joints";

// The classes that people write as A, B, C and so on.
std::string class_name(int index) { return {static_cast<char>('A' + index)}; }

void read_fingers(TableReader& reader, posed::Findings& findings, gesture::ClassLists& lists) {
  for (const gesture::ChannelGroup& finger : gesture::finger_groups()) {
    auto table = reader.table(finger.name);
    if (!table) {
      if (findings.errors.empty())
        findings.add_error(1, "there is no table [" + finger.name + "]; add it");
      continue;
    }
    auto& classes = lists.emplace_back(static_cast<std::size_t>(finger.classes));
    for (int k = 0; k < finger.classes; ++k) table->read(class_name(k), classes[k]);
    table->finish();
  }
}

// The groups with their joints, in alphabetical order, and the classes of each from A on.
std::vector<gesture::JointGroup> read_groups(TableReader& reader, gesture::ClassLists& lists) {
  std::vector<gesture::JointGroup> groups;
  for (const std::string& name : reader.keys()) {
    if (name == kNamed) continue;
    auto table = reader.table(name);
    if (!table) continue;
    gesture::JointGroup& group = groups.emplace_back(gesture::JointGroup{name, {}});
    table->read(kJoints, group.joints);
    auto& classes = lists.emplace_back();
    while (classes.size() < gesture::kMaxClasses &&
           table->has(class_name(static_cast<int>(classes.size())))) {
      const std::string next = class_name(static_cast<int>(classes.size()));
      table->read(next, classes.emplace_back());
    }
    table->finish();
  }
  return groups;
}

// Whether the tables are groups of a body's joints.
bool is_body(const toml::table& root) {
  bool fingers = false;
  for (const auto& [key, node] : root) {
    const toml::table* const table = node.as_table();
    if (table != nullptr && table->contains(kJoints)) return true;
    fingers = fingers || std::ranges::find(kFingerNames, key.str()) != kFingerNames.end();
  }
  return !root.empty() && !fingers;
}

// The labels with their classes, and those that questions may name.
Result<> set_labels(const gesture::ClassLists& lists, const std::vector<std::string>& named,
                    gesture::Vocabulary& vocabulary) {
  for (std::size_t g = 0; g < lists.size(); ++g) {
    vocabulary.groups[g].classes = std::max(1, static_cast<int>(lists[g].size()));
  }
  auto labels = TRY(gesture::labels_of(lists, vocabulary.groups));
  if (labels.empty()) return fail("no gesture is in any class");
  vocabulary.labels = std::move(labels);
  for (const std::string& name : named) {
    vocabulary.named.push_back(vocabulary.label_index(name));
    if (vocabulary.named.back() >= 0) continue;
    return fail("named has " + in_quotes(name) + ", which is in no class");
  }
  return {};
}

// A name in quotes for TOML; names have no control characters.
std::string quoted(const std::string& name) {
  std::string out = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

// "A" = ["g", "1"]
void write_list(std::ostream& out, const std::string& key, const std::vector<std::string>& names) {
  out << key << " = [";
  const char* separator = "";
  for (const std::string& name : names) out << std::exchange(separator, ", ") << quoted(name);
  out << "]\n";
}

}  // namespace

Result<gesture::Vocabulary> read_questions(const std::filesystem::path& path) {
  const auto root = load_toml(path, kQuestionLimits);
  if (!root) return misuse(root.error().message, root.error().file, root.error().line);
  posed::Findings findings{.file = path.string(), .exit_code = ExitCode::kWrongUse};
  TableReader reader(*root, "", findings);
  std::vector<std::string> named;
  reader.read(kNamed, named);
  const bool body = is_body(*root);
  gesture::ClassLists given;
  std::vector<gesture::JointGroup> groups;
  if (body) {
    groups = read_groups(reader, given);
  } else {
    read_fingers(reader, findings, given);
  }
  reader.finish();
  const auto lists = TRY(findings.result(std::move(given)));
  auto vocabulary = body ? gesture::body_vocabulary(groups) : gesture::Vocabulary{};
  if (!vocabulary) return misuse(vocabulary.error().message, path.string());
  if (auto set = set_labels(lists, named, *vocabulary); !set) {
    return misuse(set.error().message, path.string());
  }
  return vocabulary;
}

Result<> write_questions(const gesture::Vocabulary& vocabulary, const std::filesystem::path& path) {
  const gesture::ClassLists lists = gesture::lists_of(vocabulary.labels, vocabulary.groups);
  return write_whole_file(path, [&](std::ostream& out) {
    out << (vocabulary.is_hand()
                ? "# Proposed by `posed train gesture`: k-means of each finger's pose, A the most "
                  "closed.\n"
                  "# Correct it, then train with --questions; config/gestures/gcp134.toml "
                  "explains.\n"
                : "# Proposed by `posed train gesture`: poses of a group that are alike are of one "
                  "class.\n"
                  "# Correct it, then train with --questions; config/gestures/raise-arms.toml "
                  "explains.\n");
    for (std::size_t g = 0; g < lists.size(); ++g) {
      const gesture::ChannelGroup& group = vocabulary.groups[g];
      out << "\n[" << group.name << "]\n";
      if (!vocabulary.is_hand()) {
        const auto first = vocabulary.body->joints.begin() + group.first / 3;
        write_list(out, kJoints, {first, first + group.channels / 3});
      }
      for (int k = 0; k < group.classes; ++k) write_list(out, class_name(k), lists[g][k]);
    }
  });
}

}  // namespace posed::tools
