// The table of clip formats: which files posed reads and writes as a motion. The commands, the file
// driver and the help texts ask it; nothing else compares names of clip files. To add a format,
// write `Format x_format()` in a .cpp of its own and name it in formats.hpp and formats.cpp.
// Cold; all functions but add_format() may be called from any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::clip {

struct Draft;

// The fields of ReadOptions that only some formats accept.
enum class ReadOption : std::uint8_t {
  kSkeleton,
  kRate,
  kUnit,
  kUp,
  kFacing,
  kProfile,
  kHand,
  kHandShape
};

// The files of one clip in memory.
struct ClipFile {
  std::string name;             // path, for messages; parse_clip() goes by its extension
  std::string bytes;            // content
  std::string skeleton_name{};  // path of the skeleton, where that is a file of its own
  std::string skeleton{};       // content of that file
};

struct Format {
  std::string_view name;                     // "BVH", for sentences
  std::vector<std::string_view> extensions;  // in small letters, ".bvh"; the usual one first
  std::string_view article = "a";            // before the name
  bool is_hand = false;                      // holds one hand and nothing else
  bool holds_gaps = false;                   // a value may be missing (NaN)
  bool evenly_spaced = false;                // what is written: frames have no times
  // A stream of the file driver carries the file's own lines, because the logs of posed 0.1 do. The
  // frames of all other formats travel as numbers (device_clip.hpp), so a new format leaves it off.
  bool sends_text = false;
  // Extension of the file that has the skeleton; empty: the clip itself has it.
  std::string_view skeleton_extension{};
  std::vector<ReadOption> options{};  // reading accepts these and refuses all others

  // Returns whether a file that begins with these bytes (some KB) is of this format. Null: nothing
  // is recognised by its content.
  bool (*sniff)(std::string_view begin) = nullptr;
  // What spreadsheets and other programs make of a file, line by line as posed writes it. Null: a
  // file is read as it is.
  std::string (*plain)(std::string bytes) = nullptr;
  // Reads the whole clip, which is untrusted. Errors name file and line. Null: posed cannot read
  // it.
  Result<Draft> (*read)(const ClipFile& file, const ReadOptions& options) = nullptr;
  // Null: posed cannot write it.
  Result<> (*write)(const Clip& clip, const std::filesystem::path& path) = nullptr;
};

// All formats, in the order in which help texts list them.
[[nodiscard]] std::span<const Format> formats();

// Adds a format of a library that proto may not see. Call it before other threads start; a format
// of the same name is not added twice.
void add_format(Format format);

// The extension of a path in small letters, with its dot: ".bvh". Empty where there is none.
[[nodiscard]] std::string extension_of(const std::filesystem::path& path);

// The format of a name by its extension alone; null if no format has it.
[[nodiscard]] const Format* format_of(const std::filesystem::path& path);
// The format that recognises a file by its first bytes; null if none does.
inline constexpr std::size_t kSniffedBytes = 4096;
[[nodiscard]] const Format* format_of_bytes(std::string_view begin);
// The format of a file that is read: a name may be wrong, so what recognises the content comes
// before the extension. Null if neither tells.
[[nodiscard]] const Format* format_of_file(const std::filesystem::path& path);

// Selects the formats of a list: those that are read or written, all or only those of bodies.
enum class Use : std::uint8_t { kRead, kReadBody, kWrite, kWriteBody };

// "a .bvh, an .amc or a hand's .csv", for help texts and errors.
[[nodiscard]] std::string listed(Use use);
// All extensions of these formats.
[[nodiscard]] std::vector<std::string_view> extensions(Use use);

// Returns whether this file accepts the option; false for one of no format.
[[nodiscard]] bool accepts(const std::filesystem::path& path, ReadOption option);
// The options without those that this file does not accept, for commands that read several
// clips by the same options.
[[nodiscard]] ReadOptions accepted_options(const std::filesystem::path& path, ReadOptions options);
// Refuses options that a format does not accept, instead of silently ignoring them.
Result<> check_options(const Format& format, const ReadOptions& options, const std::string& file);

// Where the skeleton of a clip lies that has a file of its own, unless the user names it: of
// the files beside it the one that has the longest beginning of its name, NN.asf or NN_MM.asf of
// NN_MM.amc. Empty for other formats.
[[nodiscard]] std::filesystem::path skeleton_beside(const std::filesystem::path& path);

// A file's bytes as its format's reader wants them: text in UTF-8, Format::plain.
[[nodiscard]] std::string plain_bytes(const Format& format, std::string bytes);

// Loads a clip's files (format_of_file). An error lists what can be read.
struct LoadedClip {
  const Format* format;
  ClipFile file;
};
Result<LoadedClip> load_clip(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace posed::clip
