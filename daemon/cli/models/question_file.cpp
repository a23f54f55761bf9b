#include "daemon/cli/models/question_file.hpp"

#include <array>
#include <ostream>
#include <utility>

#include "proto/clip/text.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::cli {
namespace {

constexpr TomlLimits kQuestionLimits{
    .what = "questions file", .bytes = std::size_t{256} * 1024, .depth = 4, .items = 16384};
constexpr std::array<const char*, gesture::kClasses> kClassNames{"A", "B", "C"};

void read_fingers(const toml::table& root, Findings& findings, gesture::ClassLists& lists) {
  TableReader reader(root, "", findings);
  for (int finger = 0; finger < kFingers; ++finger) {
    const std::string name(kFingerNames[finger]);
    auto table = reader.table(name);
    if (!table) {
      if (findings.errors.empty())
        findings.add_error(1, "there is no table [" + name + "]; add it");
      continue;
    }
    for (int k = 0; k < gesture::kClasses; ++k) table->read(kClassNames[k], lists[finger][k]);
    table->finish();
  }
  reader.finish();
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

}  // namespace

Result<std::vector<gesture::Label>> read_questions(const std::filesystem::path& path) {
  const auto root = load_toml(path, kQuestionLimits);
  if (!root) return misuse(root.error().message, root.error().file, root.error().line);
  Findings findings{.file = path.string(), .exit_code = ExitCode::kWrongUse};
  gesture::ClassLists given;
  read_fingers(*root, findings, given);
  const auto lists = findings.result(std::move(given));
  if (!lists) return std::unexpected(lists.error());
  auto labels = gesture::labels_of(*lists);
  if (!labels) return misuse(labels.error().message, path.string());
  if (labels->empty()) return misuse("no gesture is in any class", path.string());
  return labels;
}

Result<> write_questions(const std::vector<gesture::Label>& labels,
                         const std::filesystem::path& path) {
  const gesture::ClassLists lists = gesture::lists_of(labels);
  return clip::write_text(path, [&](std::ostream& out) {
    out << "# Proposed by `posed train gesture`: k-means of each finger's pose, A the most "
           "closed.\n"
           "# Correct it, then train with --questions; config/gestures/gcp134.toml explains.\n";
    for (int finger = 0; finger < kFingers; ++finger) {
      out << "\n[" << kFingerNames[finger] << "]\n";
      for (int k = 0; k < gesture::kClasses; ++k) {
        out << kClassNames[k] << " = [";
        const char* separator = "";
        for (const std::string& name : lists[finger][k]) {
          out << std::exchange(separator, ", ") << quoted(name);
        }
        out << "]\n";
      }
    }
  });
}

}  // namespace posed::cli
