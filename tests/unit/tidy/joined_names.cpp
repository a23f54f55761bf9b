// Names in anonymous namespaces that would meet when the files of a target are compiled together.
#include <algorithm>
#include <map>
#include <optional>
#include <regex>

#include "tests/unit/tidy/source_tree.hpp"

namespace posed::tidy {
namespace {

struct Name {
  std::string scope{};      // "posed::drivers::"
  std::string name{};       // "Rig"
  std::string signature{};  // two files may have equal aliases, and functions of other parameters
  enum class Kind { kFunction, kAlias, kOther } kind = Kind::kOther;
  int line = 0;
};

// What a line at namespace scope declares, as clang-format writes it: parameters that do not fit
// follow on the next line.
std::optional<Name> declared(const std::string& line, const std::string& next_line) {
  static const std::regex type(R"(^(?:struct|class|enum(?: class)?|union) (\w+))");
  static const std::regex alias(R"(^using (\w+) =(.*))");
  static const std::regex function(R"(^[\w:<>,&*\[\]() ]*?[ &*](\w+)\((.*))");
  static const std::regex no_name("^(?:using|template|namespace) ");  // equal aliases may meet
  static const std::regex variable(R"(^[\w:<>,&*() ]+?[ &*](\w+)(?: =|\{|;|\[))");
  std::smatch found;
  if (std::regex_search(line, found, type)) return Name{.name = found[1]};
  if (std::regex_search(line, found, alias)) {
    return Name{.name = found[1], .signature = found[2], .kind = Name::Kind::kAlias};
  }
  if (std::regex_search(line, no_name)) return {};
  if (line.find('(') < line.find(" = ") && std::regex_search(line, found, function)) {
    const std::string rest = found[2].str().empty() ? next_line : found[2].str();
    return Name{.name = found[1], .signature = rest, .kind = Name::Kind::kFunction};
  }
  if (std::regex_search(line, found, variable)) return Name{.name = found[1]};
  return {};
}

// What the file declares in anonymous namespaces.
std::vector<Name> anonymous_names(const SourceFile& file) {
  static const std::regex opens(R"(^(?:inline )?namespace ?([\w:]*) ?\{)");
  struct Scope {
    std::string name;
    int depth;  // of braces inside it
  };
  std::vector<Name> names;
  std::vector<Scope> scopes;
  int depth = 0;
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    const std::string& line = file.code[i];
    std::smatch match;
    const bool anonymous = !scopes.empty() && scopes.back().name.empty();
    if (std::regex_search(line, match, opens)) {
      scopes.push_back({match[1], depth + 1});
    } else if (anonymous && depth == scopes.back().depth && !line.empty() && line[0] != ' ') {
      if (auto name = declared(line, i + 1 < file.code.size() ? file.code[i + 1] : "")) {
        for (const Scope& scope : scopes) name->scope += scope.name + "::";
        name->line = static_cast<int>(i) + 1;
        names.push_back(*std::move(name));
      }
    }
    depth += static_cast<int>(std::ranges::count(line, '{') - std::ranges::count(line, '}'));
    while (!scopes.empty() && depth < scopes.back().depth) scopes.pop_back();
  }
  return names;
}

bool may_stand_together(const Name& a, const Name& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == Name::Kind::kAlias) return a.signature == b.signature;
  return a.kind == Name::Kind::kFunction && a.signature != b.signature;
}

}  // namespace

std::vector<Finding> check_joined_names(const std::vector<SourceFile>& files,
                                        const std::vector<Target>& targets) {
  std::vector<Finding> findings;
  for (const Target& target : targets) {
    std::multimap<std::string, std::pair<const SourceFile*, Name>> seen;
    for (const SourceFile& file : files) {
      const std::string folder = file.path.substr(0, file.path.rfind('/'));
      if (!file.path.ends_with(".cpp") || !has_folder(target, folder)) continue;
      for (Name& name : anonymous_names(file)) {
        const std::string full = name.scope + name.name;
        const auto [first, last] = seen.equal_range(full);
        for (auto at = first; at != last; ++at) {
          const auto& [other, before] = at->second;
          if (other == &file || may_stand_together(before, name)) continue;
          findings.push_back(
              {file.path, name.line,
               name.name + " is in " + other->path + ":" + std::to_string(before.line) + ", too"});
        }
        seen.emplace(full, std::pair{&file, std::move(name)});
      }
    }
  }
  return findings;
}

}  // namespace posed::tidy
