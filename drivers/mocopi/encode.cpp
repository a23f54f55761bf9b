#include "drivers/mocopi/encode.hpp"

#include <array>

#include "drivers/byte_writer.hpp"
#include "drivers/mocopi/decoder.hpp"

namespace posed::drivers::mocopi {
namespace {

// The begin of a bone, from its parent, of a person of 1.7 m; the right side is the mirror image.
constexpr std::array<Vec3f, kBones> kPlaces_m{
    {{0, 0.93F, 0},  {0, 0.05F, 0},  {0, 0.05F, 0},      {0, 0.05F, 0},
     {0, 0.06F, 0},  {0, 0.06F, 0},  {0, 0.07F, 0},      {0, 0.07F, 0},
     {0, 0.1F, 0},   {0, 0.05F, 0},  {0, 0.05F, 0},      {0.03F, 0.06F, 0},
     {0.14F, 0, 0},  {0.27F, 0, 0},  {0.25F, 0, 0},      {-0.03F, 0.06F, 0},
     {-0.14F, 0, 0}, {-0.27F, 0, 0}, {-0.25F, 0, 0},     {0.09F, -0.04F, 0},
     {0, -0.41F, 0}, {0, -0.4F, 0},  {0, -0.07F, 0.13F}, {-0.09F, -0.04F, 0},
     {0, -0.41F, 0}, {0, -0.4F, 0},  {0, -0.07F, 0.13F}}};

// Writes fields, which may lie inside fields: a length is known when its field ends.
class FieldWriter {
 public:
  [[nodiscard]] std::size_t begin(std::string_view name) {
    const std::size_t at = writer_.size();
    writer_.u32(0);
    writer_.text(name);
    return at;
  }
  void end(std::size_t at) {
    constexpr std::size_t kHead = 8;
    const std::size_t length = writer_.size() - at - kHead;
    for (std::size_t i = 0; i < 4; ++i) {
      writer_.written()[at + i] = static_cast<std::byte>(length >> 8 * i & 0xFF);
    }
  }
  void field(std::string_view name, auto write) {
    const std::size_t at = begin(name);
    write(writer_);
    end(at);
  }
  void bone(std::string_view name, const BoneEntry& bone, bool with_parent) {
    const std::size_t at = begin(name);
    field("bnid", [&](ByteWriter& to) { to.u16(bone.id); });
    if (with_parent) field("pbid", [&](ByteWriter& to) { to.u16(bone.parent); });
    field("tran", [&](ByteWriter& to) {
      for (const float x : bone.transform.rotation_xyzw) to.f32(x);
      for (const float x_m : bone.transform.position_m) to.f32(x_m);
    });
    end(at);
  }
  // What every datagram begins with.
  void head() {
    const std::size_t at = begin("head");
    field("ftyp", [](ByteWriter& to) { to.text(kFormat); });
    field("vrsn", [](ByteWriter& to) { to.u8(kFormatVersion); });
    end(at);
    const std::size_t sender = begin("sndf");
    field("ipad", [](ByteWriter& to) { to.u64(0x0100007F); });
    field("rcvp", [](ByteWriter& to) { to.u16(12351); });
    end(sender);
  }
  [[nodiscard]] std::vector<std::byte> finish() { return writer_.finish(); }

 private:
  ByteWriter writer_;
};

}  // namespace

std::vector<std::byte> encode_skeleton(std::span<const BoneEntry> bones) {
  FieldWriter writer;
  writer.head();
  const std::size_t skeleton = writer.begin("skdf");
  const std::size_t list = writer.begin("bons");
  for (const BoneEntry& bone : bones) writer.bone("bndt", bone, /*with_parent=*/true);
  writer.end(list);
  writer.end(skeleton);
  return writer.finish();
}

std::vector<std::byte> encode_frame(std::uint32_t number, double time_s, double unix_s,
                                    std::span<const BoneEntry> bones) {
  FieldWriter writer;
  writer.head();
  const std::size_t frame = writer.begin("fram");
  writer.field("fnum", [&](ByteWriter& to) { to.u32(number); });
  writer.field("time", [&](ByteWriter& to) { to.f32(static_cast<float>(time_s)); });
  writer.field("uttm", [&](ByteWriter& to) { to.f64(unix_s); });
  const std::size_t list = writer.begin("btrs");
  for (const BoneEntry& bone : bones) writer.bone("btdt", bone, /*with_parent=*/false);
  writer.end(list);
  writer.end(frame);
  return writer.finish();
}

std::vector<BoneEntry> average_bones(float scale) {
  std::vector<BoneEntry> bones;
  bones.reserve(kBones);
  for (std::uint16_t id = 0; id < kBones; ++id) {
    const auto& [x, y, z] = kPlaces_m[id];
    bones.push_back({.id = id,
                     .parent = usual_parent(id),
                     .transform = {.rotation_xyzw = kIdentity,
                                   .position_m = {scale * x, scale * y, scale * z}}});
  }
  return bones;
}

Result<std::shared_ptr<const Skeleton>> average_skeleton(float scale) {
  const auto datagram = encode_skeleton(average_bones(scale));
  Datagram decoded;
  static_cast<void>(decode_datagram(datagram, decoded));
  const auto layout = TRY(make_layout(decoded.content));
  return layout->bodies[0].skeleton;
}

}  // namespace posed::drivers::mocopi
