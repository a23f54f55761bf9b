#include "proto/text/toml.hpp"

#include <algorithm>
#include <vector>

#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed {
namespace {

constexpr std::size_t kMaxDescription = 300;  // bytes; toml++ can repeat a whole key in its message
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// An open array or inline table; the first level is the line itself.
struct Level {
  bool keyed = false;  // contains keys: the line itself or an inline table
  bool in_key = false;
  int parts = 0;  // parts of the key being read, or of the key whose value is being read
};

class Scanner {
 public:
  Scanner(std::string_view text, const TomlLimits& limits)
      : text_(text), limits_(limits), levels_{Level{.keyed = true, .in_key = true, .parts = 1}} {}

  // Returns the problem found; empty when there is none.
  [[nodiscard]] std::string scan() {
    while (!text_.empty()) {
      const char c = text_.front();
      if (c == '#') {
        text_.remove_prefix(std::min(text_.find('\n'), text_.size()));
      } else if (c == '"' || c == '\'') {
        skip_string(c);
      } else {
        text_.remove_prefix(1);
        accept(c);
      }
      if (depth() > limits_.depth) {
        return "nests deeper here than the " + std::to_string(limits_.depth) + " levels of a " +
               std::string(limits_.what) + " (each part of a dotted key is one)";
      }
      if (items_ > limits_.items) {
        return "has more than " + std::to_string(limits_.items) + " keys and values, which no " +
               std::string(limits_.what) + " needs";
      }
    }
    return {};
  }

  [[nodiscard]] int line() const { return line_; }

 private:
  [[nodiscard]] int depth() const {
    int sum = header_parts_ + static_cast<int>(levels_.size()) - 1;
    for (const Level& level : levels_) sum += level.parts;
    return sum;
  }

  void accept(char c) {
    Level& level = levels_.back();
    switch (c) {
      case '\n':
        ++line_;
        if (levels_.size() == 1) begin_line();
        break;
      case '.':
        if (level.in_key) ++level.parts;  // a dot outside a key belongs to a number or a date
        break;
      case '=':
        if (level.in_key) ++items_;
        level.in_key = false;
        break;
      case ',':
        ++items_;
        if (level.keyed) level = {.keyed = true, .in_key = true, .parts = 1};
        break;
      case '[':
        if (level.in_key) {
          begin_header();
        } else {
          levels_.push_back({});
        }
        break;
      case '{':
        levels_.push_back({.keyed = true, .in_key = true, .parts = 1});
        break;
      case ']':
      case '}':
        if (in_header_) {
          end_header();
        } else if (levels_.size() > 1) {
          levels_.pop_back();
        }
        break;
      default:
        break;
    }
  }

  void begin_line() {
    levels_.back() = {.keyed = true, .in_key = true, .parts = 1};
    in_header_ = false;
  }

  // While a header is read its parts count as a key's; then they add to every key below it.
  void begin_header() {
    header_parts_ = 0;
    in_header_ = true;
  }

  void end_header() {
    Level& level = levels_.back();
    header_parts_ = level.parts;
    level = {.keyed = true, .in_key = false, .parts = 0};
    in_header_ = false;
    ++items_;
  }

  void skip_string(char quote) {
    const std::string closing(3, quote);
    const bool multi_line = text_.starts_with(closing);
    text_.remove_prefix(multi_line ? 3 : 1);
    while (!text_.empty()) {
      const char c = text_.front();
      if (c == '\n' && !multi_line) return;  // not valid TOML: the parser will stop here
      if (c == quote && (!multi_line || text_.starts_with(closing))) {
        // Up to two quotes before the closing three belong to the string.
        std::size_t run = multi_line ? 3 : 1;
        while (multi_line && run < 5 && run < text_.size() && text_[run] == quote) ++run;
        text_.remove_prefix(run);
        return;
      }
      if (c == '\\' && quote == '"') text_.remove_prefix(1);  // an escaped quote does not end it
      if (!text_.empty()) {
        if (text_.front() == '\n') ++line_;
        text_.remove_prefix(1);
      }
    }
  }

  std::string_view text_;  // the rest of the text
  const TomlLimits& limits_;
  std::vector<Level> levels_;
  int header_parts_ = 0;
  bool in_header_ = false;
  std::size_t items_ = 0;
  int line_ = 1;
};

}  // namespace

Result<> check_toml(std::string_view text, const std::string& file, const TomlLimits& limits) {
  if (text.size() > limits.bytes) {
    return fail(
        "is larger than " + size_text(limits.bytes) + ": that is no " + std::string(limits.what),
        file);
  }
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  Scanner scanner(text, limits);
  const std::string wrong = scanner.scan();
  if (wrong.empty()) return {};
  return fail(wrong, file, scanner.line());
}

Result<toml::table> parse_toml(std::string_view text, const std::string& file,
                               const TomlLimits& limits) {
  TRY(check_toml(text, file, limits));
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    return fail("not TOML: " + clean(error.description(), kMaxDescription) +
                    "; was the file cut off, or mistyped here?",
                file, static_cast<int>(error.source().begin.line));
  }
}

Result<toml::table> load_toml(const std::filesystem::path& path, const TomlLimits& limits) {
  const auto text = TRY(load_file(path, {.what = limits.what, .max_bytes = limits.bytes}));
  return parse_toml(text, path.string(), limits);
}

}  // namespace posed
