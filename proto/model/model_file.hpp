// The envelope of a model file: 8 bytes POSEDMDL, u32 version, u64 payload length, u32 CRC-32
// (zlib's) of the payload, all little-endian, then posed.v1.ModelFile (drawn in proto/README.md).
// The bytes are untrusted: this checks the envelope, and the module of each model checks its
// content. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "posed/v1/model.pb.h"
#include "proto/frame/result.hpp"

namespace posed::model_file {

// Returns the payload of a whole model file. `name` is used in error messages only. Invalid bytes
// of any kind give an Error, never a crash.
Result<v1::ModelFile> open(std::span<const std::byte> bytes, const std::string& name);

// Returns the whole file that contains `file`; fills in posed's version. The same model gives the
// same bytes.
[[nodiscard]] std::string wrap(v1::ModelFile file);

// The largest model file that is read; far larger than any that `posed train` writes.
inline constexpr std::size_t kMaxModelFile = std::size_t{256} * 1024 * 1024;  // bytes

// Read and write the bytes of a model file. A file is written completely or not at all; only a
// regular file of at most kMaxModelFile is read.
Result<std::string> load(const std::filesystem::path& path);
Result<> save(const std::string& bytes, const std::filesystem::path& path);

}  // namespace posed::model_file
