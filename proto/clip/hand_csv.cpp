// The hand CSV: reads its header and times, and writes one.
#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>

#include "proto/clip/draft.hpp"
#include "proto/clip/formats.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/median.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr double kSameTime_s = 1e-6;  // times closer than this count as the same
constexpr double kUnixTime_s = 1e8;   // no recording lasts three years
// The number of the row, the time, the angles, and one that is too many.
constexpr std::size_t kMaxFields = kHandChannels + 3;
constexpr double kMinRate_hz = 1.0;       // slower times are counted in another unit
constexpr double kUntimedRate_hz = 30.0;  // of a file without times
constexpr double kEven = 0.01;            // relative difference below which steps count as equal

// Column names without the time column: thumb1_x_rad ... little3_z_rad.
const std::array<std::string, kHandChannels>& column_names() {
  static const auto names = [] {
    std::array<std::string, kHandChannels> all;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i] = std::string(kFingerNames[i / kFingerChannels]) +
               std::to_string(i % kFingerChannels / 3 + 1) + '_' + "xyz"[i % 3] + "_rad";
    }
    return all;
  }();
  return names;
}

std::string header_line() {
  std::string line = "time_s";
  for (const std::string& name : column_names()) line += ',' + name;
  return line;
}

// The fields of a line, without blanks and quotes around them; of more than a hand CSV has none
// follow the first that is too many.
std::vector<std::string_view> fields_of(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  for (std::size_t end = 0; end != std::string_view::npos && fields.size() < kMaxFields;) {
    end = line.find(separator);
    std::string_view field = trim(line.substr(0, end));
    if (field.size() > 1 && field.starts_with('"') && field.ends_with('"')) {
      field = trim(field.substr(1, field.size() - 2));
    }
    fields.push_back(field);
    if (end != std::string_view::npos) line.remove_prefix(end + 1);
  }
  return fields;
}

// Spreadsheets save a hand CSV with semicolons and decimal commas, or with tabs; pandas and R put
// the number of the row in front; R quotes the names. What has another header stays as it is.
std::string plain_csv(std::string bytes) {
  std::string_view rest = without_bom(bytes);
  std::string plain;
  if (rest.starts_with("sep=")) {  // a line that Excel understands
    static_cast<void>(next_line(rest));
    plain = "\n";
  }
  const std::string_view header = rest.substr(0, rest.find_first_of("\r\n"));
  const char separator = header.contains(';') ? ';' : header.contains('\t') ? '\t' : ',';
  const auto names = fields_of(header, separator);
  const std::size_t first = names.front().empty() ? 1 : 0;
  const bool is_plain = separator == ',' && first == 0 && !header.contains('"');
  if (is_plain || names.size() != first + 1 + kHandChannels || names[first] != "time_s") {
    return plain.empty() ? bytes : plain + std::string(rest);
  }
  // Where numbers have points, a comma is none: 1,234 may be a thousand.
  const bool has_points = rest.contains('.');
  while (!rest.empty()) {
    const auto fields = fields_of(next_line(rest), separator);
    if (fields.size() <= first) plain += ',';  // a row of its number alone
    for (std::size_t i = first; i < fields.size(); ++i) {
      if (i > first) plain += ',';
      for (const char c : fields[i]) plain += c == ',' && !has_points ? '.' : c;
    }
    plain += '\n';
  }
  return plain;
}

Result<> check_header(std::string_view line, const std::string& name, int line_number) {
  for (std::size_t i = 0; i <= kHandChannels; ++i) {
    const std::string_view expected =
        i == 0 ? std::string_view("time_s") : std::string_view(column_names()[i - 1]);
    const std::size_t comma = line.find(',');
    const std::string_view found = trim(line.substr(0, comma));
    if (found != expected) {
      return fail("column " + std::to_string(i + 1) + " is " + in_quotes(found) +
                      " where a hand CSV has '" + std::string(expected) +
                      "'; its header is time_s,thumb1_x_rad,thumb1_y_rad, ..., little3_z_rad" +
                      (i == 0 ? ", and of a program that writes another CSV posed reads .bvh,"
                                " .fbx and .glb: export one there"
                              : ""),
                  name, line_number);
    }
    line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
    if (i == kHandChannels && comma != std::string_view::npos) {
      return fail("has more than the 46 columns of a hand CSV", name, line_number);
    }
  }
  return {};
}

// 1 / median step; for an even clock, whose stamps are only rounded, 1 / mean step.
double rate_of(const std::vector<double>& steps_s) {
  const double middle_s = median(std::vector(steps_s));
  const bool is_even = std::ranges::all_of(
      steps_s, [&](double s) { return std::abs(s - middle_s) < kEven * middle_s; });
  if (!is_even) return 1.0 / middle_s;
  double sum_s = 0.0;
  for (const double s : steps_s) sum_s += s;
  return static_cast<double>(steps_s.size()) / sum_s;
}

// Interpolates missing times between known ones; before and after them it extrapolates by `step_s`.
void interpolate(std::vector<double>& time_s, double step_s) {
  const auto known = [](double t) { return !std::isnan(t); };
  auto at = std::ranges::find_if(time_s, known);
  if (at == time_s.end()) {
    for (std::size_t i = 0; i < time_s.size(); ++i) time_s[i] = static_cast<double>(i) * step_s;
    return;
  }
  for (auto before = at; before != time_s.begin(); --before) *(before - 1) = *before - step_s;
  while (at != time_s.end()) {
    const auto next = std::find_if(at + 1, time_s.end(), known);
    const double gap = static_cast<double>(next - at);
    const double step = next == time_s.end() ? step_s : (*next - *at) / gap;
    for (auto i = at + 1; i != next; ++i) *i = *at + step * static_cast<double>(i - at);
    at = next;
  }
}

// Completes the times of the frames as hand_clip.hpp describes; NaN marks a missing one. Sets the
// rate to 1 / median step.
Result<> settle_times(Draft& draft, const std::string& name) {
  const std::vector<FrameSpan>& frames = draft.text->frames;
  std::vector<double>& time_s = draft.time_s;
  std::vector<double> steps_s;
  double last_s = 0.0;
  std::size_t last = time_s.size();  // index of the last known time; none so far
  int missing = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    double& now_s = time_s[i];
    if (last < time_s.size() && now_s < last_s) {
      return fail("frame " + std::to_string(i + 1) + ": its time " + number_text(now_s) +
                      " lies before the " + number_text(last_s) + " of a frame above it",
                  name, frames[i].line);
    }
    if (last < time_s.size() && now_s - last_s < kSameTime_s) now_s = std::nan("");
    if (std::isnan(now_s)) {
      ++missing;
      continue;
    }
    if (last < time_s.size()) steps_s.push_back((now_s - last_s) / static_cast<double>(i - last));
    last_s = now_s;
    last = i;
  }
  const double rate_hz = steps_s.empty() ? kUntimedRate_hz : rate_of(steps_s);
  draft.frame_rate_hz = rate_hz;
  if (missing > 0) {
    draft.warnings.push_back(std::to_string(missing) + " of " + std::to_string(time_s.size()) +
                             " frames have no time of their own; " +
                             (steps_s.empty() ? "played at " + number_text(rate_hz) + " Hz"
                                              : std::string("placed between the others")));
  }
  if (rate_hz < kMinRate_hz) {
    return fail("its times are " + number_text(std::round(1000.0 / rate_hz) / 1000.0) +
                    " s apart, which is no"
                    " recording of a hand; time_s counts seconds, so divide the times by 1000 if"
                    " they are milliseconds",
                name, frames.front().line);
  }
  interpolate(time_s, 1.0 / rate_hz);
  // Unix time, as loggers write it, counts from the first frame.
  const double first_s = time_s.front();
  if (first_s > kUnixTime_s) {
    for (double& t : time_s) t -= first_s;
  }
  return {};
}

Result<Draft> read_hand_csv(const ClipFile& file, const ReadOptions& options) {
  const auto shape = TRY(find_hand_shape(options.hand_shape));
  const std::string_view all = without_bom(file.bytes);
  Draft draft;
  TextFrames& frames = draft.text.emplace();
  bool has_header = false;
  std::string_view rest = all;
  for (int number = 1; !rest.empty(); ++number) {
    const std::string_view line = trim(next_line(rest));
    if (line.empty()) continue;
    if (has_header) {
      if (frames.frames.empty()) {
        frames.header = all.substr(0, line.data() - all.data());
      }
      frames.frames.push_back({.text = line, .line = number});
      continue;
    }
    TRY(check_header(line, file.name, number));
    has_header = true;
  }
  if (!has_header) return fail("is empty, so it is no hand CSV", file.name);
  draft.skeleton = hand_skeleton(options.hand.value_or(Side::kRight), *shape);
  draft.skeleton_is_known = true;
  frames.parser = FrameParser::hand_csv();
  if (frames.frames.empty()) return draft;
  TRY(read_frames(frames, file.name, draft.values, draft.time_s));
  TRY(settle_times(draft, file.name));
  return draft;
}

Result<> write(const Clip& clip, const std::filesystem::path& path) {
  const auto hand = TRY(hand_of(clip));
  return write_hand_csv(hand, path);
}

}  // namespace

Format hand_csv_format() {
  return {.name = "hand CSV",
          .extensions = {".csv"},
          .is_hand = true,
          .holds_gaps = true,
          .sends_text = true,
          .options = {ReadOption::kHand, ReadOption::kHandShape},
          .sniff =
              [](std::string_view begin) {
                return has_line(begin, "time_s,") || has_line(begin, "time_s;") ||
                       has_line(begin, "time_s\t");
              },
          .plain = plain_csv,
          .read = read_hand_csv,
          .write = write};
}

Result<> write_hand_csv(const HandClip& clip, const std::filesystem::path& path) {
  return write_whole_file(path, [&clip](std::ostream& file) {
    file << header_line() << '\n';
    for (std::size_t i = 0; i < clip.angles.size(); ++i) {
      std::string line = number_text(clip.time_s[i]);
      for (const double angle_rad : clip.angles[i]) {
        line += ',';
        if (std::isfinite(angle_rad)) line += number_text(angle_rad);
      }
      file << line << '\n';
    }
  });
}

}  // namespace posed::clip
