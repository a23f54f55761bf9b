#include "proto/clip/formats.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include "proto/clip/draft.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/list.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/lower.hpp"

namespace posed::clip {
namespace {

constexpr FileRule kClip{.what = "clip", .max_bytes = 2'000'000'000};
constexpr std::uintmax_t kMaxSkeletonFile = 16'000'000;  // bytes; real files have about 10 KB

std::vector<Format>& table() {
  static std::vector<Format> all{bvh_format(), amc_format(), hand_csv_format(), glb_format(),
                                 gltf_format()};
  return all;
}

bool has(const Format& format, ReadOption option) {
  return std::ranges::find(format.options, option) != format.options.end();
}

bool serves(const Format& format, Use use) {
  const bool reads = use == Use::kRead || use == Use::kReadBody;
  if (reads ? format.read == nullptr : format.write == nullptr) return false;
  return !format.is_hand || use == Use::kRead || use == Use::kWrite;
}

struct GivenOption {
  ReadOption option;
  std::string_view words;
  bool given;
};

std::array<GivenOption, 8> given(const ReadOptions& options) {
  return {{{ReadOption::kSkeleton, "a skeleton", !options.skeleton.empty()},
           {ReadOption::kRate, "a rate", options.rate_hz.has_value()},
           {ReadOption::kUnit, "a unit of length", options.metres_per_unit.has_value()},
           {ReadOption::kUp, "an upward axis", options.up.has_value()},
           {ReadOption::kFacing, "a facing", options.facing.has_value()},
           {ReadOption::kProfile, "a profile", !options.profile.empty()},
           {ReadOption::kHand, "a hand", options.hand.has_value()},
           {ReadOption::kHandShape, "a hand shape", options.hand_shape != kDefaultHandShape}}};
}

// The first bytes of a regular file; empty if it cannot be read, which load_file() then reports.
std::string first_bytes(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kSniffedBytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(file.gcount());
  return bytes;
}

// A skeleton has the clip's name or the beginning of it up to a '_', as 07.asf of 07_01.amc has;
// the longest that is there, or else the shortest.
std::filesystem::path beside(const Format& format, const std::filesystem::path& path) {
  std::string stem = path.stem().string();
  while (true) {
    auto skeleton = path.parent_path() / (stem + std::string(format.skeleton_extension));
    const std::size_t cut = stem.rfind('_');
    if (cut == std::string::npos || cut == 0 || expect_there(skeleton)) return skeleton;
    stem.resize(cut);
  }
}

Result<> load_skeleton(const Format& format, const std::filesystem::path& path,
                       const ReadOptions& options, ClipFile& file) {
  const auto skeleton = options.skeleton.empty() ? beside(format, path) : options.skeleton;
  if (options.skeleton.empty() && !expect_there(skeleton)) {
    return fail(
        "needs its skeleton: " + skeleton.string() + " is not there; name it with --skeleton",
        file.name);
  }
  const std::string what = "skeleton (" + std::string(format.skeleton_extension) + ")";
  auto content = TRY(load_file(skeleton, {.what = what, .max_bytes = kMaxSkeletonFile}));
  file.skeleton_name = skeleton.string();
  file.skeleton = utf8_of(std::move(content));
  return {};
}

}  // namespace

std::span<const Format> formats() { return table(); }

void add_format(Format format) {
  if (std::ranges::find(table(), format.name, &Format::name) == table().end()) {
    table().push_back(std::move(format));
  }
}

std::string extension_of(const std::filesystem::path& path) {
  return lower(path.extension().string());
}

const Format* format_of(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  const auto found = std::ranges::find_if(table(), [&](const Format& format) {
    return std::ranges::find(format.extensions, extension) != format.extensions.end();
  });
  return found == table().end() ? nullptr : &*found;
}

const Format* format_of_bytes(std::string_view begin) {
  begin = without_bom(begin.substr(0, kSniffedBytes));
  const auto found = std::ranges::find_if(table(), [&](const Format& format) {
    return format.sniff != nullptr && format.sniff(begin);
  });
  return found == table().end() ? nullptr : &*found;
}

const Format* format_of_file(const std::filesystem::path& path) {
  const Format* format = format_of_bytes(utf8_of(first_bytes(path)));
  return format != nullptr ? format : format_of(path);
}

std::string listed(Use use) {
  std::vector<std::string> words;
  for (const Format& format : table()) {
    if (!serves(format, use)) continue;
    for (const std::string_view extension : format.extensions) {
      words.push_back((format.is_hand ? "a hand's " : "") + std::string(extension));
    }
  }
  return alternatives(words);
}

std::vector<std::string_view> extensions(Use use) {
  std::vector<std::string_view> all;
  for (const Format& format : table()) {
    if (!serves(format, use)) continue;
    all.insert(all.end(), format.extensions.begin(), format.extensions.end());
  }
  return all;
}

bool accepts(const std::filesystem::path& path, ReadOption option) {
  const Format* format = format_of_file(path);
  return format != nullptr && has(*format, option);
}

ReadOptions accepted_options(const std::filesystem::path& path, ReadOptions options) {
  const ReadOptions none;
  const Format* format = format_of_file(path);
  const auto accepted = [format](ReadOption option) {
    return format != nullptr && has(*format, option);
  };
  if (!accepted(ReadOption::kSkeleton)) options.skeleton = none.skeleton;
  if (!accepted(ReadOption::kRate)) options.rate_hz = none.rate_hz;
  if (!accepted(ReadOption::kUnit)) options.metres_per_unit = none.metres_per_unit;
  if (!accepted(ReadOption::kUp)) options.up = none.up;
  if (!accepted(ReadOption::kFacing)) options.facing = none.facing;
  if (!accepted(ReadOption::kProfile)) options.profile = none.profile;
  if (!accepted(ReadOption::kHand)) options.hand = none.hand;
  if (!accepted(ReadOption::kHandShape)) options.hand_shape = none.hand_shape;
  return options;
}

Result<> check_options(const Format& format, const ReadOptions& options, const std::string& file) {
  for (const GivenOption& option : given(options)) {
    if (!option.given || has(format, option.option)) continue;
    std::vector<std::string> others;
    for (const Format& other : table()) {
      if (has(other, option.option)) others.emplace_back(other.name);
    }
    return misuse("is " + std::string(format.article) + " " + std::string(format.name) +
                      ", and only " + alternatives(others) + " accepts " +
                      std::string(option.words) + "; leave it out",
                  file);
  }
  return {};
}

std::filesystem::path skeleton_beside(const std::filesystem::path& path) {
  const Format* format = format_of_file(path);
  if (format == nullptr || format->skeleton_extension.empty()) return {};
  return beside(*format, path);
}

std::string plain_bytes(const Format& format, std::string bytes) {
  bytes = utf8_of(std::move(bytes));
  return format.plain == nullptr ? std::move(bytes) : format.plain(std::move(bytes));
}

Result<LoadedClip> load_clip(const std::filesystem::path& path, const ReadOptions& options) {
  LoadedClip loaded{.format = format_of_file(path), .file = {.name = path.string(), .bytes = {}}};
  if (loaded.format == nullptr || loaded.format->read == nullptr) {
    TRY(expect_there(path));
    const std::string extension = extension_of(path);
    const auto whose = std::ranges::find(table(), extension, &Format::skeleton_extension);
    if (!extension.empty() && whose != table().end()) {
      return fail("is the skeleton of an " + std::string(whose->name) + "; name the " +
                      std::string(whose->extensions.front()) + " that moves it",
                  loaded.file.name);
    }
    return fail("is no clip posed can read; a clip is " + listed(Use::kRead) +
                    ". Export the skeleton, not markers, as one of these from the program that"
                    " made the file",
                loaded.file.name);
  }
  TRY(check_options(*loaded.format, options, loaded.file.name));
  auto bytes = TRY(load_file(path, kClip));
  loaded.file.bytes = plain_bytes(*loaded.format, std::move(bytes));
  if (loaded.format->skeleton_extension.empty()) return loaded;
  TRY(load_skeleton(*loaded.format, path, options, loaded.file));
  return loaded;
}

}  // namespace posed::clip
