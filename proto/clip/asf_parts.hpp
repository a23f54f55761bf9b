// The content of an ASF file before it becomes a Skeleton; private to the ASF reader.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/acclaim.hpp"
#include "proto/clip/text.hpp"

namespace posed::clip {

// Splits an ASF into words. `#` begins a comment; commas and parentheses count as white space.
class Words {
 public:
  explicit Words(std::string_view text) : text_(without_bom(text)) { fill(); }

  [[nodiscard]] std::string_view peek() const { return word_; }  // empty at the end
  [[nodiscard]] std::string_view take() {
    const std::string_view word = word_;
    line_ = word_line_;
    fill();
    return word;
  }
  [[nodiscard]] int line() const { return line_; }                   // line of the word taken last
  [[nodiscard]] int next_line_number() const { return word_line_; }  // line of the next word
  [[nodiscard]] bool starts_section() const { return first_ && word_.starts_with(':'); }

 private:
  [[nodiscard]] static bool is_blank(char c) {
    return is_space(c) || c == ',' || c == '(' || c == ')';
  }

  void fill() {
    first_ = false;
    while (true) {
      while (!rest_.empty() && is_blank(rest_.front())) rest_.remove_prefix(1);
      if (!rest_.empty() && rest_.front() != '#') break;
      if (text_.empty()) {
        word_ = {};
        return;
      }
      rest_ = next_line(text_);
      ++word_line_;
      first_ = true;
    }
    std::size_t end = 0;
    while (end < rest_.size() && !is_blank(rest_[end])) ++end;
    word_ = rest_.substr(0, end);
    rest_.remove_prefix(end);
  }

  std::string_view text_;
  std::string_view rest_;  // rest of the current line
  std::string_view word_;
  int word_line_ = 0;
  int line_ = 1;
  bool first_ = false;  // `word_` is the first on its line
};

struct AsfBone {
  std::string name;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double length = 0.0;
  std::array<double, 3> axis{};
  std::string axis_order = "xyz";
  std::vector<std::string> dof;
  std::vector<std::array<double, 2>> limits;  // one pair per dof, or empty
  std::vector<int> children;
  bool has_parent = false;
};

struct AsfFile {
  std::vector<AsfBone> bones;  // the root is the first
  Eigen::Vector3d root_position = Eigen::Vector3d::Zero();
  double length_unit = 1.0;  // in inches; 0.45 in CMU's files
  bool degrees = true;
};

// `name` is used in error messages.
[[nodiscard]] Result<Acclaim> acclaim_of(const AsfFile& file, const std::string& name);

}  // namespace posed::clip
