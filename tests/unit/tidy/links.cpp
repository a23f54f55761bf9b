// What may include what, as the modules' CMakeLists.txt files say it.
#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "tests/unit/tidy/source_tree.hpp"

namespace posed::tidy {
namespace {

const Target* find(const std::vector<Target>& targets, const std::string& name) {
  const auto found = std::ranges::find(targets, name, &Target::name);
  return found == targets.end() ? nullptr : &*found;
}

// The names of all that `target` links, directly or through others, itself included.
std::set<std::string> linked(const std::vector<Target>& targets, const Target& target) {
  std::set<std::string> names;
  std::vector<const Target*> open{&target};
  while (!open.empty()) {
    const Target* const next = open.back();
    open.pop_back();
    if (!names.insert(next->name).second) continue;
    for (const std::string& link : next->links) {
      if (const Target* known = find(targets, link)) open.push_back(known);
    }
  }
  return names;
}

std::string folder_of(const std::string& path) { return path.substr(0, path.rfind('/')); }

const Target* owner_of(const std::vector<Target>& targets, const std::string& folder) {
  const auto found = std::ranges::find_if(
      targets, [&](const Target& target) { return has_folder(target, folder); });
  return found == targets.end() ? nullptr : &*found;
}

}  // namespace

bool has_folder(const Target& target, const std::string& folder) {
  const std::string any = folder_of(folder) + "/*";  // every folder beside this one
  return std::ranges::find_first_of(target.folders, std::array{folder, any}) !=
         target.folders.end();
}

std::vector<Target> targets_from_text(const std::string& text, const std::string& command) {
  const std::regex call(command + R"(\(([^)]*)\))");
  std::vector<Target> targets;
  for (std::sregex_iterator at(text.begin(), text.end(), call), end; at != end; ++at) {
    std::istringstream words((*at)[1].str());
    Target target;
    words >> target.name;
    std::vector<std::string>* list = nullptr;
    for (std::string word; words >> word;) {
      if (word == "FOLDERS") {
        list = &target.folders;
      } else if (word == "LINK") {
        list = &target.links;
      } else if (list != nullptr) {
        list->push_back(word);
      }
    }
    targets.push_back(std::move(target));
  }
  return targets;
}

std::vector<Target> read_targets(const std::filesystem::path& root) {
  std::vector<Target> targets;
  for (const char* module_name : {"proto", "models", "drivers", "daemon", "daemon/tools"}) {
    std::ifstream stream(root / module_name / "CMakeLists.txt");
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    for (Target& target : targets_from_text(text)) targets.push_back(std::move(target));
  }
  return targets;
}

std::vector<Target> read_test_programs(const std::filesystem::path& root) {
  std::ifstream stream(root / "tests/CMakeLists.txt");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  std::vector<Target> programs = targets_from_text(text, "posed_test");
  for (Target& program : programs) {
    for (std::string& folder : program.folders) folder.insert(0, "tests/");
  }
  return programs;
}

std::vector<Finding> check_cycles(const std::vector<Target>& targets) {
  std::vector<Finding> findings;
  for (const Target& target : targets) {
    for (const std::string& link : target.links) {
      const Target* const known = find(targets, link);
      if (known != nullptr && linked(targets, *known).contains(target.name)) {
        findings.push_back({target.name, 0, "links " + link + ", which links it, too: a cycle"});
      }
    }
  }
  return findings;
}

std::vector<Finding> check_links(const SourceFile& file, const std::vector<Target>& targets) {
  static const std::regex include("^\\s*#\\s*include\\s*\"([^\"]+)/[^\"/]+\"");
  std::vector<Finding> findings;
  const Target* const own = owner_of(targets, folder_of(file.path));
  if (own == nullptr) return findings;
  const std::set<std::string> permitted = linked(targets, *own);
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (!std::regex_search(file.lines[i], match, include)) continue;
    const Target* const other = owner_of(targets, match[1].str());
    if (other == nullptr || permitted.contains(other->name)) continue;
    findings.push_back({file.path, static_cast<int>(i) + 1,
                        own->name + " does not link " + other->name + ", so it may not include " +
                            match[1].str() + "/"});
  }
  return findings;
}

}  // namespace posed::tidy
