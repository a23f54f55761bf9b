#include "drivers/natnet/encode.hpp"

#include <array>
#include <string>

#include "drivers/byte_writer.hpp"

namespace posed::drivers::natnet {
namespace {

void write_text(ByteWriter& writer, std::string_view text) {
  writer.text(text);
  writer.u8(0);
}

void write_vector(ByteWriter& writer, const Vec3f& v) {
  for (const float x : v) writer.f32(x);
}

std::int32_t count_of(const auto& entries) { return static_cast<std::int32_t>(entries.size()); }

// A part of a frame or an entry of a ModelDef: its count or kind, from 4.1 its size, and its
// content.
template <typename WriteEntries>
void write_part(ByteWriter& writer, Version version, std::int32_t count, WriteEntries write) {
  writer.i32(count);
  ByteWriter entries;
  write(entries);
  if (version >= Version{4, 1}) writer.i32(static_cast<std::int32_t>(entries.size()));
  writer.bytes(entries.written());
}

void write_rigid_body(ByteWriter& writer, const RigidBody& body, const Reading& reading,
                      bool is_bone, bool invented) {
  const Version version = reading.version;
  writer.i32(body.id);
  write_vector(writer, body.position_m);
  for (const float x : body.rotation_xyzw) writer.f32(x);
  if (reading.padded) writer.u32(0);
  if (version < Version{3, 0}) {
    writer.i32(invented ? 1 : 0);  // one marker: position, id, size
    if (invented) {
      write_vector(writer, body.position_m);
      writer.i32(1);
      writer.f32(0.02F);
    }
  }
  writer.f32(0.0005F);  // mean error
  if (version >= Version{2, 6} && (!is_bone || reading.bones_have_params)) {
    writer.i16(body.tracked ? 1 : 0);
  }
}

void write_labelled(ByteWriter& writer, const LabelledMarker& marker, Version version) {
  writer.u32(std::uint32_t{marker.model} << 16 | marker.number);
  write_vector(writer, marker.position_m);
  writer.f32(0.014F);  // size
  if (version >= Version{2, 6}) writer.i16(static_cast<std::int16_t>(marker.occluded ? 0xb : 0xa));
  if (version >= Version{3, 0}) writer.f32(0.0002F);  // residual
}

// A force plate or a device with one channel of one value.
void write_channel(ByteWriter& writer) {
  writer.i32(1);
  writer.i32(1);
  writer.i32(1);
  writer.f32(1.5F);
}

// An asset (from 4.1: a trained marker set) with one bone and one marker, as the vendor's Python
// client of NatNet SDK 4.1 reads it. posed skips assets, other clients do not.
void write_asset(ByteWriter& writer) {
  writer.i32(7);  // its id
  writer.i32(1);  // bones: id, place, rotation, mean error, tracked
  writer.i32(1);
  write_vector(writer, {1.0F, 1.0F, 1.0F});
  for (const float x : kIdentity) writer.f32(x);
  writer.f32(0.0005F);
  writer.i16(1);
  writer.i32(1);  // markers: id, place, size, flags, residual
  writer.i32(1);
  write_vector(writer, {1.0F, 1.0F, 1.0F});
  writer.f32(0.014F);
  writer.i16(0xa);
  writer.f32(0.0002F);
}

void write_parts(ByteWriter& writer, const FramePacket& frame, const Reading& reading) {
  const Version version = reading.version;
  const auto write_invented = [&](auto write) {
    if (frame.invented) return write_part(writer, version, 1, write);
    write_part(writer, version, 0, [](ByteWriter&) {});
  };
  write_invented([](ByteWriter& to) {
    write_text(to, "all");
    to.i32(1);
    write_vector(to, {1.0F, 2.0F, 3.0F});
  });
  write_invented([](ByteWriter& to) { write_vector(to, {3.0F, 2.0F, 1.0F}); });
  write_part(writer, version, count_of(frame.rigid_bodies), [&](ByteWriter& to) {
    for (const RigidBody& body : frame.rigid_bodies) {
      write_rigid_body(to, body, reading, false, frame.invented);
    }
  });
  write_part(writer, version, count_of(frame.skeletons), [&](ByteWriter& to) {
    for (const SkeletonPacket& skeleton : frame.skeletons) {
      to.i32(skeleton.id);
      to.i32(count_of(skeleton.bones));
      for (const RigidBody& bone : skeleton.bones) {
        write_rigid_body(to, bone, reading, true, frame.invented);
      }
    }
  });
  if (version >= Version{4, 1}) write_invented(write_asset);
  write_part(writer, version, count_of(frame.labelled), [&](ByteWriter& to) {
    for (const LabelledMarker& marker : frame.labelled) write_labelled(to, marker, version);
  });
  if (version >= Version{2, 9}) write_invented(write_channel);
  if (version >= Version{2, 11}) write_invented(write_channel);
  if (version >= Version{4, 5}) {  // two parts that posed does not know
    write_invented(write_channel);
    write_invented([](ByteWriter& to) { to.u16(7); });
  }
}

void write_suffix(ByteWriter& writer, const FramePacket& frame, const Reading& reading) {
  const Version version = reading.version;
  if (version < Version{3, 0}) writer.f32(static_cast<float>(frame.timestamp_s));
  writer.u32(frame.timecode);
  writer.u32(0);
  if (version >= Version{2, 7}) {
    writer.f64(frame.timestamp_s);
  } else if (reading.timestamp) {
    writer.f32(static_cast<float>(frame.timestamp_s));
  }
  if (version >= Version{3, 0}) {
    for (const std::uint64_t ticks :
         {frame.exposure_ticks, frame.received_ticks, frame.sent_ticks}) {
      writer.u64(ticks);
    }
  }
  if (version >= Version{4, 1}) writer.u64(0);
  if (version >= Version{2, 6}) writer.i16(frame.bodies_changed ? 2 : 0);
  writer.i32(0);
}

void write_bone(ByteWriter& writer, const BoneDef& bone, Version version) {
  write_text(writer, bone.name);
  writer.i32(bone.id);
  writer.i32(bone.parent);
  write_vector(writer, bone.offset_m);
  if (version >= Version{4, 2}) {
    for (const float part : {0.0F, 0.0F, 0.0F, 1.0F}) writer.f32(part);  // its rotation at rest
  }
  if (version < Version{3, 0}) return;
  writer.i32(static_cast<std::int32_t>(bone.markers));
  for (std::size_t i = 0; i < bone.markers; ++i) write_vector(writer, {});
  for (std::size_t i = 0; i < bone.markers; ++i) writer.i32(0);
  if (version < Version{4, 0}) return;
  for (std::size_t i = 0; i < bone.markers; ++i) write_text(writer, "Marker");
}

void write_body(ByteWriter& writer, const BodyDef& body, Version version) {
  if (!body.is_skeleton) return write_bone(writer, body.bones.front(), version);
  write_text(writer, body.name);
  writer.i32(body.id);
  writer.i32(count_of(body.bones));
  for (const BoneDef& bone : body.bones) write_bone(writer, bone, version);
}

void write_model_def(ByteWriter& writer, const ModelDef& model, Version version) {
  writer.i32(static_cast<std::int32_t>(model.markers.size() + model.bodies.size()));
  for (const auto& [name, count] : model.markers) {
    write_part(writer, version, 0, [&](ByteWriter& to) {
      write_text(to, name);
      to.i32(static_cast<std::int32_t>(count));
      for (std::size_t i = 1; i <= count; ++i) write_text(to, "Marker" + std::to_string(i));
    });
  }
  for (const BodyDef& body : model.bodies) {
    write_part(writer, version, body.is_skeleton ? 2 : 1,
               [&](ByteWriter& to) { write_body(to, body, version); });
  }
}

}  // namespace

std::vector<std::byte> encode_frame(const FramePacket& frame, const Reading& reading) {
  ByteWriter writer;
  writer.u32(frame.number);
  write_parts(writer, frame, reading);
  write_suffix(writer, frame, reading);
  return encode_message(MessageId::kFrame, writer.written());
}

std::vector<std::byte> encode_model_def(const ModelDef& model, Version version) {
  ByteWriter writer;
  write_model_def(writer, model, version);
  return encode_message(MessageId::kModelDef, writer.written());
}

std::vector<std::byte> encode_description(const ModelDef& model, Version version,
                                          const DescriptionHead& head) {
  std::array<std::byte, kDescriptionHeadBytes> first{};
  write_description_head(head, first);
  ByteWriter writer;
  writer.bytes(first);
  write_model_def(writer, model, version);
  return writer.finish();
}

}  // namespace posed::drivers::natnet
