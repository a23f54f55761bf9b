#include <algorithm>

#include "proto/clip/acclaim.hpp"
#include "proto/clip/reader.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

bool is_frame_number(std::string_view line) {
  return !line.empty() && std::ranges::all_of(line, [](char c) { return c >= '0' && c <= '9'; });
}

// Splits `amc` into its header and the blocks of the frames; reads the header's unit of angles.
Result<> split(std::string_view amc, const std::string& name, Draft& draft, bool& degrees) {
  std::string_view rest = amc;
  std::optional<std::size_t> frame;  // where the block being read begins
  int frame_line = 0;
  const auto close = [&](std::size_t end) {
    if (frame)
      draft.frames.push_back({.text = amc.substr(*frame, end - *frame), .line = frame_line});
  };
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t begin = amc.size() - rest.size();
    const std::string_view line = trim(next_line(rest));
    if (is_frame_number(line)) {
      close(begin);
      if (!frame) draft.header = amc.substr(0, begin);
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

}  // namespace

Result<Draft> draft_amc(std::string_view amc, const std::string& amc_name, std::string_view asf,
                        const std::string& asf_name, const ReadOptions& options) {
  auto acclaim = parse_asf(asf, asf_name);
  if (!acclaim) return std::unexpected(acclaim.error());
  if (!(options.amc_rate_hz > 0.1 && options.amc_rate_hz <= 100'000.0)) {
    return misuse("the frame rate of an AMC should be more than 0.1 and at most 100000 Hz");
  }
  const auto profile = find_profile(acclaim->skeleton, options.profile);
  if (!profile) return std::unexpected(profile.error());
  Draft draft;
  draft.profile = *profile;
  bool degrees = acclaim->degrees;
  if (auto ok = split(without_bom(amc), amc_name, draft, degrees); !ok) {
    return std::unexpected(ok.error());
  }
  draft.parser = FrameParser::amc(*acclaim, degrees);
  draft.skeleton = std::move(acclaim->skeleton);
  draft.skeleton.name = std::filesystem::path(asf_name).stem().string();
  draft.metres_per_unit = acclaim->metres_per_unit;
  draft.frame_rate_hz = options.amc_rate_hz;
  return draft;
}

Result<Clip> parse_amc(std::string_view amc, const std::string& amc_name, std::string_view asf,
                       const std::string& asf_name, const ReadOptions& options) {
  auto draft = draft_amc(amc, amc_name, asf, asf_name, options);
  if (!draft) return std::unexpected(draft.error());
  return clip_of(std::move(*draft), amc_name);
}

}  // namespace posed::clip
