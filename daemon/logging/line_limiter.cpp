#include "daemon/logging/line_limiter.hpp"

#include <algorithm>
#include <utility>

namespace posed::logging {
namespace {

constexpr std::int64_t kPeriod_ns = kNanosPerSecond;
constexpr std::int64_t kPeriodOfKind_ns = 8 * kNanosPerSecond;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_of_word(char c) {
  return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
}

// "the text (the last of 12 like it)"
std::string with_count(const LineLimiter::Line& last, std::uint64_t held) {
  if (held == 1) return last.text;
  return last.text + " (the last of " + std::to_string(held) + " like it)";
}

}  // namespace

std::string cause_of(std::string_view text) {
  const std::size_t colon = text.find(": ");
  const std::size_t blank = text.find(' ');
  std::size_t at = colon != text.npos && blank > colon ? colon : 0;
  std::string cause(text.substr(0, at));
  bool in_word = false;
  while (at < text.size()) {
    if (is_digit(text[at]) && !in_word) {
      cause += '#';
      while (at < text.size() && (is_digit(text[at]) || text[at] == '.')) ++at;
      in_word = true;  // the unit behind a number belongs to it
      continue;
    }
    // A minus sign belongs to its number.
    const bool sign = text[at] == '-' && !in_word && at + 1 < text.size() && is_digit(text[at + 1]);
    if (!sign) {
      cause += text[at];
      in_word = is_of_word(text[at]);
    }
    ++at;
  }
  return cause;
}

bool LineLimiter::may_begin_another(std::int64_t now_ns) {
  if (credit_ns_ != kNoTime_ns) {
    credit_ = std::min(kMaxAtOnce, credit_ + kNewPerSecond * seconds(now_ns - credit_ns_));
  }
  credit_ns_ = now_ns;
  if (credit_ < 1.0) return false;
  credit_ -= 1.0;
  return true;
}

bool LineLimiter::admit_of_kind(std::int64_t now_ns, const Line& last, std::uint64_t count) {
  const std::string cause = cause_of(last.text);
  const std::size_t colon = cause.find(": ");
  if (colon == cause.npos || cause.find(' ') < colon) return true;  // not of a stream
  Kind& kind = kinds_[std::to_string(last.level) + cause.substr(colon)];
  kind.credit =
      std::min(kStreamsAtOnce, kind.credit + kOfKindPerSecond * seconds(now_ns - kind.credit_ns));
  kind.credit_ns = now_ns;
  if (kind.credit >= 1.0) {
    kind.credit -= 1.0;
    return true;
  }
  if (kind.held.held == 0)
    kind.held.written_ns = std::max(kind.held.written_ns, now_ns - kPeriodOfKind_ns);
  kind.held.held += count;
  kind.held.last = last;
  return false;
}

bool LineLimiter::admit(std::int64_t now_ns, int level, std::string_view text) {
  std::string key = std::to_string(level) + cause_of(text);
  const auto found = causes_.find(key);
  if (found != causes_.end()) {
    Cause& cause = found->second;
    if (cause.held == 0 && now_ns - cause.written_ns >= kPeriod_ns) {
      cause.written_ns = now_ns;
      return admit_of_kind(now_ns, {level, std::string(text)}, 1);
    }
    ++cause.held;
    cause.last = {level, std::string(text)};
    return false;
  }
  std::erase_if(causes_, [&](const auto& entry) {
    return entry.second.held == 0 && now_ns - entry.second.written_ns >= kPeriod_ns;
  });
  if (!may_begin_another(now_ns)) {
    if (others_.held++ == 0 && others_.written_ns == kNoTime_ns) others_.written_ns = now_ns;
    others_.last.level = std::max(others_.last.level, level);
    return false;
  }
  std::erase_if(kinds_, [&](const auto& entry) {
    const Kind& kind = entry.second;
    const double credit = kind.credit + kOfKindPerSecond * seconds(now_ns - kind.credit_ns);
    return kind.held.held == 0 && credit >= kStreamsAtOnce;
  });
  causes_.emplace(std::move(key), Cause{.written_ns = now_ns, .held = 0, .last = {}});
  return admit_of_kind(now_ns, {level, std::string(text)}, 1);
}

std::optional<LineLimiter::Line> LineLimiter::next_summary(std::int64_t now_ns, bool at_end) {
  const auto due = [&](const Cause& cause, std::int64_t period_ns = kPeriod_ns) {
    return cause.held > 0 && (at_end || now_ns - cause.written_ns >= period_ns);
  };
  for (auto& [key, cause] : causes_) {
    if (!due(cause)) continue;
    const std::uint64_t held = std::exchange(cause.held, 0);
    Line line{cause.last.level, with_count(cause.last, held), cause_of(cause.last.text), held};
    cause.written_ns = now_ns;
    if (admit_of_kind(now_ns, cause.last, held)) return line;
  }
  for (auto& [key, kind] : kinds_) {
    if (!due(kind.held, kPeriodOfKind_ns)) continue;
    const std::uint64_t held = std::exchange(kind.held.held, 0);
    kind.held.written_ns = now_ns;
    const Line& last = kind.held.last;
    return Line{last.level, with_count(last, held), cause_of(last.text), held};
  }
  if (!due(others_)) return std::nullopt;
  Line line{others_.last.level,
            std::to_string(others_.held) + " more lines of many kinds are left out",
            "lines of many kinds", others_.held};
  others_ = {.written_ns = now_ns, .held = 0, .last = {}};
  return line;
}

std::int64_t LineLimiter::next_due_ns() const {
  std::int64_t next_ns = kNoTime_ns;
  const auto look = [&](const Cause& cause, std::int64_t period_ns = kPeriod_ns) {
    if (cause.held == 0) return;
    const std::int64_t due_ns = cause.written_ns + period_ns;
    next_ns = next_ns == kNoTime_ns ? due_ns : std::min(next_ns, due_ns);
  };
  for (const auto& [key, cause] : causes_) look(cause);
  for (const auto& [key, kind] : kinds_) look(kind.held, kPeriodOfKind_ns);
  look(others_);
  return next_ns;
}

}  // namespace posed::logging
