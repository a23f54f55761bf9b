#include "tests/unit/tidy/source_tree.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace posed::tidy {
namespace {

constexpr std::ptrdiff_t kMaxColumns = 100;

// Replaces comments and the contents of string and character literals by blanks, keeping all
// columns.
class Blanker {
 public:
  std::string line(const std::string& text) {
    std::string code = text;
    for (std::size_t i = 0; i < code.size(); ++i) {
      if (!raw_end_.empty()) {
        i = blank_raw(code, i);
      } else if (in_block_comment_) {
        if (code.compare(i, 2, "*/") == 0) {
          in_block_comment_ = false;
          code[i + 1] = ' ';
        }
        code[i] = ' ';
      } else if (code.compare(i, 2, "/*") == 0) {
        in_block_comment_ = true;
        code[i] = ' ';
      } else if (code.compare(i, 2, "//") == 0) {
        std::fill(code.begin() + static_cast<std::ptrdiff_t>(i), code.end(), ' ');
      } else if (code.compare(i, 2, "R\"") == 0 && code.find('(', i) != std::string::npos) {
        raw_end_ = ")" + code.substr(i + 2, code.find('(', i) - i - 2) + "\"";
        i = blank_raw(code, i);
      } else if (code[i] == '"' || (code[i] == '\'' && !is_digit_separator(code, i))) {
        i = blank_literal(code, i);
      }
    }
    return code;
  }

 private:
  static bool is_digit_separator(const std::string& code, std::size_t i) {
    return i > 0 && std::isxdigit(static_cast<unsigned char>(code[i - 1])) != 0;
  }
  static std::size_t blank_literal(std::string& code, std::size_t start) {
    const char quote = code[start];
    std::size_t i = start + 1;
    for (; i < code.size() && code[i] != quote; ++i) {
      if (code[i] == '\\' && i + 1 < code.size()) code[i++] = ' ';
      code[i] = ' ';
    }
    return i;
  }
  // To the end of the raw string, or of the line. Returns the last place that is blank.
  std::size_t blank_raw(std::string& code, std::size_t start) {
    const std::size_t end = code.find(raw_end_, start);
    const std::size_t stop = end == std::string::npos ? code.size() : end + raw_end_.size();
    std::fill(code.begin() + static_cast<std::ptrdiff_t>(start),
              code.begin() + static_cast<std::ptrdiff_t>(stop), ' ');
    if (end != std::string::npos) raw_end_.clear();
    return stop - 1;
  }

  bool in_block_comment_ = false;
  std::string raw_end_;  // what closes the raw string; empty: in none
};

std::string first_folder(const std::string& path) { return path.substr(0, path.find('/')); }

struct Ban {
  std::regex pattern;
  const char* why;
};

const std::vector<Ban>& hot_bans() {
  static const std::vector<Ban> bans = [] {
    std::vector<Ban> list;
    const auto add = [&list](const char* pattern, const char* why) {
      list.push_back({std::regex(pattern), why});
    };
    add(R"(\bnew\b|\b(m|c|re)alloc\s*\(|\bmake_(unique|shared)\b)", "allocates");
    add(R"(\.(push_back|emplace_back|emplace|insert|resize|reserve|append)\s*\()", "may allocate");
    add(R"(\bstd::(string|vector|map|unordered_map|function|ostringstream|to_string)\b\s*[<({ ])",
        "may allocate");
    add(R"(\b(MatrixXd|VectorXd|MatrixXf|VectorXf)\s+\w+)", "allocates");
    add(R"(\b(mutex|lock_guard|unique_lock|scoped_lock|condition_variable)\b)", "locks");
    add(R"(\b(spdlog::|printf|std::cout|std::cerr|SPDLOG_))", "logs");
    add(R"(\bthrow\b|\.at\s*\()", "may throw");
    add(R"(\b(sleep_for|usleep|nanosleep|fopen|ioctl|sendto|recvfrom|zmq_send|getenv)\b)",
        "calls the system");
    return list;
  }();
  return bans;
}

// Whether a line has the macro RT_SAFE before a declaration, or a comment that calls what follows
// RT-safe.
bool marks_hot_code(const SourceFile& file, std::size_t line) {
  static const std::regex macro(R"(^\s*(template\b.*>\s*)?RT_SAFE\b)");
  if (std::regex_search(file.code[line], macro)) return true;
  const auto said = file.lines[line].find("RT-safe");
  return said != std::string::npos && file.lines[line].find("//") < said;
}

// The line on which the body that starts at or after `from` closes; `from` itself when there is no
// body.
std::size_t end_of_body(const std::vector<std::string>& code, std::size_t from) {
  int depth = 0;
  bool opened = false;
  for (std::size_t i = from; i < code.size(); ++i) {
    for (const char c : code[i]) {
      if (c == '{') {
        ++depth;
        opened = true;
      }
      if (c == '}') --depth;
      if (c == ';' && !opened) return from;  // a declaration
      if (opened && depth <= 0) return i;
    }
  }
  return from;
}

}  // namespace

SourceFile source_from_text(std::string path, const std::string& text) {
  SourceFile file;
  file.path = std::move(path);
  Blanker blanker;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    file.code.push_back(blanker.line(line));
    file.lines.push_back(std::move(line));
  }
  return file;
}

std::vector<SourceFile> read_source_tree(const std::filesystem::path& root) {
  std::vector<SourceFile> files;
  for (const char* room : {"proto", "models", "drivers", "daemon", "tests"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / room)) {
      const auto extension = entry.path().extension();
      if (extension != ".hpp" && extension != ".cpp") continue;
      std::ifstream stream(entry.path());
      const std::string text{std::istreambuf_iterator<char>(stream), {}};
      files.push_back(
          source_from_text(std::filesystem::relative(entry.path(), root).generic_string(), text));
    }
  }
  return files;
}

std::vector<Finding> check_includes(const SourceFile& file) {
  static const std::map<std::string, std::string> allowed{
      {"proto", "proto|posed"},
      {"models", "proto|posed|models"},
      {"drivers", "proto|posed|drivers"},
      {"daemon", "proto|posed|models|drivers|daemon"},
      {"tests", "proto|posed|models|drivers|daemon|tests"}};
  const std::regex include("^\\s*#\\s*include\\s*\"([^\"/]+)/?[^\"]*\"");
  const std::regex permitted("(" + allowed.at(first_folder(file.path)) + ")");
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (!std::regex_search(file.lines[i], match, include)) continue;
    if (!std::regex_match(match[1].str(), permitted)) {
      findings.push_back(
          {file.path, static_cast<int>(i) + 1,
           "may not include " + match[1].str() + "/ (include from the repository's root)"});
    }
  }
  return findings;
}

std::vector<Finding> check_references(const std::string& path, const std::string& text) {
  // Spelled in halves so that this file does not find itself.
  static const std::regex outside(std::string("\\.\\./sha") + "red|algorithms\\.md|hand-sci" +
                                  "ence|style-sci" + "ence|house-rev" + "iew|first-use\\.md");
  std::vector<Finding> findings;
  std::istringstream stream(text);
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (std::regex_search(line, outside)) {
      findings.push_back({path, number, "names a page outside the repository"});
    }
  }
  return findings;
}

std::vector<Finding> check_title(const std::string& path, const std::string& text) {
  if (!path.ends_with("README.md") || text.starts_with("# ")) return {};
  return {{path, 1, "a README whose first line is no title (\"# \")"}};
}

std::vector<Finding> check_sizes(const SourceFile& file) {
  std::vector<Finding> findings;
  // Written in two halves so that this check does not report its own source.
  const std::regex mark(std::string("\\b(TO") + "DO|FIX" + "ME|XX" + "X)\\b");
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const int line = static_cast<int>(i) + 1;
    // Bytes that continue a character (10xxxxxx in UTF-8) take no column.
    const auto columns = std::ranges::count_if(
        file.lines[i], [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
    if (columns > kMaxColumns) findings.push_back({file.path, line, "over 100 columns"});
    if (std::regex_search(file.lines[i], mark))
      findings.push_back({file.path, line, "left-over mark"});
  }
  return findings;
}

std::vector<Finding> check_field_comments(const SourceFile& file) {
  static const std::regex field(R"(^\s*(?!option|syntax|reserved)[\w. <>,]+ \w+ = \d+;)");
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string& line = file.lines[i];
    if (!std::regex_search(line, field) || line.find("; ") != std::string::npos) continue;
    findings.push_back({file.path, static_cast<int>(i) + 1, "a field without a comment"});
  }
  return findings;
}

std::vector<Finding> check_guarded_input(const SourceFile& file) {
  static const std::regex parses(R"(\btoml::parse(_file)?\b\s*\()");
  static const std::regex reads_all(R"(\bistreambuf_iterator\b|\brdbuf\s*\()");
  const bool is_guard = file.path == "proto/text/toml.cpp";
  const bool is_test = first_folder(file.path) == "tests";
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    const int line = static_cast<int>(i) + 1;
    if (!is_guard && std::regex_search(file.code[i], parses)) {
      findings.push_back({file.path, line, "parses TOML without the guard of proto/text/toml.hpp"});
    }
    if (!is_test && std::regex_search(file.code[i], reads_all)) {
      findings.push_back(
          {file.path, line, "reads a whole file without the bounds of proto/text/load_file.hpp"});
    }
  }
  return findings;
}

std::vector<Finding> check_throwing_paths(const SourceFile& file) {
  static const std::regex asks(
      R"(\b(?:std::filesystem|fs)::(?:\w*exists|is_\w+|file_size|\w*status|create_\w+|remove\w*|)"
      R"(rename|\w*canonical|absolute|current_path|temp_directory_path|equivalent|copy\w*|)"
      R"(last_write_time|read_symlink|relative|proximate|permissions|resize_file|space|)"
      R"(hard_link_count|\w*directory_iterator(?:\s+\w+)?)\s*[({](?![)}]))");
  static const std::regex ranges(R"(\bfor\s*\([^;]*[^:]:[^:][^;]*directory_iterator)");
  static const std::regex declared(R"(\berror_code&?\s+(\w+))");
  if (first_folder(file.path) == "tests") return {};
  std::string text;
  for (const std::string& line : file.code) text += line + '\n';
  std::set<std::string> codes;
  for (std::sregex_iterator at(text.begin(), text.end(), declared), end; at != end; ++at) {
    codes.insert((*at)[1]);
  }
  std::vector<Finding> findings;
  const auto find = [&](std::size_t at) {
    const auto line =
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    findings.push_back({file.path, static_cast<int>(line) + 1,
                        "throws where a path cannot be used; pass an std::error_code"});
  };
  for (std::sregex_iterator at(text.begin(), text.end(), ranges), end; at != end; ++at) {
    find(at->position());
  }
  for (std::sregex_iterator at(text.begin(), text.end(), asks), end; at != end; ++at) {
    const std::size_t first = at->position() + at->length();
    std::size_t last = first;
    for (int depth = 1; last < text.size(); ++last) {
      depth += text[last] == '(' || text[last] == '{' ? 1 : 0;
      depth -= text[last] == ')' || text[last] == '}' ? 1 : 0;
      if (depth == 0) break;
    }
    const std::string arguments = text.substr(first, last - first);
    static const std::regex last_word(R"((\w+)\s*$)");
    std::smatch word;
    if (!std::regex_search(arguments, word, last_word) || !codes.contains(word[1])) find(first);
  }
  return findings;
}

std::vector<Finding> check_try(const SourceFile& file) {
  static const std::regex begins(R"(\bTRY\()");
  // What a statement ends, begins or is under, or one `=`.
  static const std::regex before(R"((?:^|[;{})]|\belse|[^=!<>+*/|&^-]=)\s*$)");
  std::string text;
  for (const std::string& line : file.code) {
    text += line.starts_with('#') ? std::string("\n") : line + '\n';
  }
  std::vector<Finding> findings;
  for (std::sregex_iterator at(text.begin(), text.end(), begins), end; at != end; ++at) {
    const std::size_t first = at->position();
    std::size_t last = text.find('(', first);
    for (int depth = 0; last < text.size(); ++last) {
      depth += text[last] == '(' ? 1 : 0;
      depth -= text[last] == ')' ? 1 : 0;
      if (depth == 0) break;
    }
    const std::size_t next = text.find_first_not_of(" \n", last + 1);
    const std::string left =
        text.substr(first < 80 ? 0 : first - 80, std::min<std::size_t>(first, 80));
    if (next < text.size() && text[next] == ';' && std::regex_search(left, before)) continue;
    const auto line =
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(first), '\n');
    findings.push_back({file.path, static_cast<int>(line) + 1,
                        "TRY is a part of an expression; give its value a name first"});
  }
  return findings;
}

std::vector<Finding> check_hot_code(const SourceFile& file, int& bodies) {
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    if (!marks_hot_code(file, i)) continue;
    // A comment may continue; the function starts at the first line with code.
    std::size_t start = i;
    while (start < file.code.size() &&
           file.code[start].find_first_not_of(' ') == std::string::npos) {
      ++start;
    }
    if (start == file.code.size()) break;
    if (file.code[start].starts_with('#')) continue;  // the comment is about the whole file
    const std::size_t end = end_of_body(file.code, start);
    if (end == start && file.code[start].find('{') == std::string::npos) continue;
    ++bodies;
    // In a class that is RT-safe as a whole, member declarations may allocate, because its
    // constructor is cold.
    const bool is_class = file.code[start].starts_with("class ");
    int depth = 0;
    for (std::size_t line = start; line <= end; ++line) {
      const int before = depth;
      for (const char c : file.code[line]) depth += c == '{' ? 1 : c == '}' ? -1 : 0;
      if (is_class && before <= 1 && depth <= 1) continue;
      for (const Ban& ban : hot_bans()) {
        if (std::regex_search(file.code[line], ban.pattern)) {
          findings.push_back({file.path, static_cast<int>(line) + 1,
                              std::string(ban.why) + " in a function marked RT_SAFE"});
        }
      }
    }
  }
  return findings;
}

}  // namespace posed::tidy
