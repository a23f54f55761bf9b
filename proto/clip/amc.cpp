#include <algorithm>

#include "proto/clip/acclaim.hpp"
#include "proto/clip/draft.hpp"
#include "proto/clip/formats.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/lower.hpp"

namespace posed::clip {
namespace {

constexpr double kUsualRate_hz = 120.0;  // an AMC does not state its rate

bool is_frame_number(std::string_view line) {
  return !line.empty() && std::ranges::all_of(line, [](char c) { return c >= '0' && c <= '9'; });
}

// Splits `amc` into its header and the blocks of the frames; reads the header's unit of angles.
Result<> split(std::string_view amc, const std::string& name, TextFrames& frames, bool& degrees) {
  std::string_view rest = amc;
  std::optional<std::size_t> frame;  // where the block being read begins
  int frame_line = 0;
  const auto close = [&](std::size_t end) {
    if (frame)
      frames.frames.push_back({.text = amc.substr(*frame, end - *frame), .line = frame_line});
  };
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t begin = amc.size() - rest.size();
    const std::string_view line = trim(next_line(rest));
    if (is_frame_number(line)) {
      close(begin);
      if (!frame) frames.header = amc.substr(0, begin);
      frame = begin;
      frame_line = number;
    } else if (!frame) {
      const std::string word = lower(line);
      if (word == ":degrees") degrees = true;
      if (word == ":radians") degrees = false;
      if (!word.empty() && !word.starts_with(':') && !word.starts_with('#')) {
        return fail(in_quotes(line) + " stands before the first frame's number; is this an AMC?",
                    name, number);
      }
    }
  }
  close(amc.size());
  return {};
}

Result<Draft> read_amc(const ClipFile& file, const ReadOptions& options) {
  auto acclaim = TRY(parse_asf(file.skeleton, file.skeleton_name));
  const double rate_hz = options.rate_hz.value_or(kUsualRate_hz);
  if (!(rate_hz > 0.1 && rate_hz <= 100'000.0)) {
    return misuse("the frame rate of an AMC should be more than 0.1 and at most 100000 Hz");
  }
  const auto profile = TRY(find_profile(acclaim.skeleton, options.profile));
  Draft draft;
  draft.profile = profile;
  bool degrees = acclaim.degrees;
  TextFrames& frames = draft.text.emplace();
  TRY(split(without_bom(file.bytes), file.name, frames, degrees));
  frames.parser = FrameParser::amc(acclaim, degrees);
  draft.skeleton = std::move(acclaim.skeleton);
  draft.skeleton.name = std::filesystem::path(file.skeleton_name).stem().string();
  draft.metres_per_unit = acclaim.metres_per_unit;
  draft.frame_rate_hz = rate_hz;
  draft.up_may_err = true;
  draft.said_up = options.up;
  draft.said_facing = options.facing;
  if (options.metres_per_unit) {  // instead of what the skeleton says
    draft.said_unit_m = *options.metres_per_unit / draft.metres_per_unit;
  }
  TRY(read_frames(frames, file.name, draft.values, draft.time_s));
  return draft;
}

}  // namespace

Format amc_format() {
  return {.name = "AMC",
          .extensions = {".amc"},
          .article = "an",
          .sends_text = true,
          .skeleton_extension = ".asf",
          .options = {ReadOption::kSkeleton, ReadOption::kRate, ReadOption::kUnit, ReadOption::kUp,
                      ReadOption::kFacing, ReadOption::kProfile},
          .sniff =
              [](std::string_view begin) {
                return has_line(begin, ":DEGREES") || has_line(begin, ":FULLY-SPECIFIED");
              },
          .read = read_amc};
}

}  // namespace posed::clip
