#include "proto/clip/files.hpp"

#include "proto/clip/file_names.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/load_file.hpp"

namespace posed::clip {
namespace {

constexpr FileRule kClip{.what = "clip", .max_bytes = 2'000'000'000};
constexpr std::uintmax_t kMaxSkeletonFile = 16'000'000;  // bytes; real files have about 10 KB

}  // namespace

Result<ClipFiles> load_files(const std::filesystem::path& path, const ReadOptions& options) {
  ClipFiles files;
  files.name = path.string();
  const std::string extension = extension_of(path);
  if (extension == ".amc") {
    files.kind = ClipKind::kAmc;
  } else if (extension == ".csv") {
    files.kind = ClipKind::kHandCsv;
  } else if (extension != ".bvh") {
    if (!std::filesystem::exists(path)) return fail("is not there; check the path", files.name);
    return fail("is no clip posed can read; a clip ends in .bvh, .amc or .csv", files.name);
  }
  auto text = load_file(path, kClip);
  if (!text) return std::unexpected(text.error());
  files.text = std::move(*text);
  if (files.kind != ClipKind::kAmc) return files;

  const std::filesystem::path asf = options.asf.empty() ? skeleton_beside(path) : options.asf;
  if (options.asf.empty() && !std::filesystem::exists(asf)) {
    return fail("needs its skeleton: " + asf.string() + " is not there; name it with --skeleton",
                files.name);
  }
  files.asf_name = asf.string();
  auto skeleton = load_file(asf, {.what = "skeleton (.asf)", .max_bytes = kMaxSkeletonFile});
  if (!skeleton) return std::unexpected(skeleton.error());
  files.asf = std::move(*skeleton);
  return files;
}

Result<Draft> draft_of(const ClipFiles& files, const ReadOptions& options) {
  switch (files.kind) {
    case ClipKind::kAmc:
      return draft_amc(files.text, files.name, files.asf, files.asf_name, options);
    case ClipKind::kHandCsv:
      return draft_hand_csv(files.text, files.name, options);
    case ClipKind::kBvh:
      break;
  }
  return draft_bvh(files.text, files.name, options);
}

}  // namespace posed::clip
