#include "proto/model/model_file.hpp"

#include <cstdint>
#include <cstring>

#include <google/protobuf/descriptor.h>
#include <zlib.h>

#include "proto/frame/whole_file.hpp"
#include "proto/message/wire_reader.hpp"
#include "proto/text/load_file.hpp"

namespace posed::model_file {
namespace {

constexpr std::string_view kMagic = "POSEDMDL";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 24;

// Of a file, all its messages together; packed numbers are one field. The largest models have about
// 5,000: four for each of 1,000 labels, eight for each of 81 trees, the joints.
constexpr std::size_t kMaxFields = 20'000;

// Of a file: packed integers take one byte or more there, and four and more in memory. The trees of
// the largest models have 1.3 million.
constexpr std::size_t kMaxIntegerBytes = 4'000'000;

struct Counted {
  std::size_t fields = 0, integer_bytes = 0;

  [[nodiscard]] bool too_many() const {
    return fields > kMaxFields || integer_bytes > kMaxIntegerBytes;
  }
};

template <typename T>
void put(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<char>((value >> (8 * i)) & 0xFF));
  }
}

template <typename T>
T get(std::span<const std::byte> bytes) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value |= static_cast<T>(std::to_integer<T>(bytes[i]) << (8 * i));
  }
  return value;
}

std::uint32_t crc_of(const void* data, std::size_t size) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), static_cast<const Bytef*>(data), size));
}

// Adds what a message and those inside it have, and stops where it is too much; false where the
// bytes are no message. protobuf makes an object of 16 to 200 bytes of a field that takes two in
// the file, so they are counted before it sees them.
bool count(std::span<const std::byte> bytes, const google::protobuf::Descriptor& type,
           Counted& counted) {
  using google::protobuf::FieldDescriptor;
  message::WireReader reader(bytes);
  for (message::WireField field; !counted.too_many() && reader.next(field); ++counted.fields) {
    const auto* const known = type.FindFieldByNumber(static_cast<int>(field.number));
    if (known == nullptr || field.type != message::WireType::kBytes) continue;
    const bool reals = known->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
                       known->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
    if (known->is_packable() && !reals) counted.integer_bytes += field.bytes.size();
    if (known->message_type() == nullptr) continue;
    if (!count(field.bytes, *known->message_type(), counted)) return false;
  }
  return reader.ok();
}

}  // namespace

Result<v1::ModelFile> open(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) {
    return fail("this is not a posed model; make one with `posed train`", name);
  }
  const auto version = get<std::uint32_t>(bytes.subspan(8));
  if (version > kVersion) {
    return fail("the model is of a newer posed (version " + std::to_string(version) +
                    ", this one reads up to " + std::to_string(kVersion) + "); update posed",
                name);
  }
  if (version == 0) return fail("the model has no version; copy it again", name);
  const auto length = get<std::uint64_t>(bytes.subspan(12));
  const auto payload = bytes.subspan(kHeaderBytes);
  if (length != payload.size()) {
    return fail("the model is cut short or has something after it: " + std::to_string(length) +
                    " bytes promised, " + std::to_string(payload.size()) + " there; copy it again",
                name);
  }
  if (get<std::uint32_t>(bytes.subspan(20)) != crc_of(payload.data(), payload.size())) {
    return fail("the model's checksum does not fit its bytes; copy it again", name);
  }
  Counted counted;
  const bool is_message = count(payload, *v1::ModelFile::descriptor(), counted);
  if (counted.too_many()) {
    return fail("the model has more than " + std::to_string(kMaxFields) + " fields, or " +
                    std::to_string(kMaxIntegerBytes) +
                    " bytes of integers, which no model of `posed train` has; train it again",
                name);
  }
  v1::ModelFile file;
  if (!is_message || payload.size() > INT32_MAX ||
      !file.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    return fail("the model's payload cannot be read; train it again", name);
  }
  return file;
}

std::string wrap(v1::ModelFile file) {
  file.set_posed_version(POSED_VERSION);
  const std::string payload = file.SerializeAsString();
  std::string out(kMagic);
  put<std::uint32_t>(out, kVersion);
  put<std::uint64_t>(out, payload.size());
  put<std::uint32_t>(out, crc_of(payload.data(), payload.size()));
  return out + payload;
}

Result<std::string> load(const std::filesystem::path& path) {
  return load_file(path, {.what = "model", .max_bytes = kMaxModelFile});
}

Result<> save(const std::string& bytes, const std::filesystem::path& path) {
  return write_whole_file(path, [&](std::ostream& stream) {
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  });
}

}  // namespace posed::model_file
