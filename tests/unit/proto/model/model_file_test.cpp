// The envelope of a model file: what is refused before protobuf spends memory on it.
#include "proto/model/model_file.hpp"

#include <string>

#include <catch2/catch.hpp>

#include "tests/fuzz/model_envelope.hpp"

using namespace posed;

namespace {

Result<v1::ModelFile> opened(const std::string& payload) {
  const std::string file = fuzz::as_model_file(payload);
  return model_file::open(std::as_bytes(std::span(file)), "test.model");
}

// A field of this number that holds `bytes`.
std::string field(int number, const std::string& bytes) {
  std::string out(1, static_cast<char>(number << 3 | 2));
  std::size_t size = bytes.size();
  for (; size >= 0x80; size >>= 7) out += static_cast<char>(size | 0x80);
  return out + static_cast<char>(size) + bytes;
}

std::string repeated(const std::string& one, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += one;
  return all;
}

constexpr int kStyle = 2, kGesture = 3;    // of ModelFile
constexpr int kLabel = 2, kTree = 3;       // of GestureModel
constexpr int kFarTooMany = 1'000'000;     // 2 MB of a file, 100 MB and more in protobuf
constexpr int kManyIntegers = 16'000'000;  // 16 MB of a file, 190 MB in protobuf and what reads it
constexpr const char* kRefusal =
    "fields, or 4000000 bytes of integers, which no model of `posed train` has; train it again";

}  // namespace

TEST_CASE("A model file of endless small messages, texts or integers is refused", "[model_file]") {
  for (const std::string& payload : {
           field(kGesture, repeated(field(kTree, ""), kFarTooMany)),
           field(kGesture, repeated(field(kLabel, field(1, "g")), kFarTooMany)),
           field(kStyle, repeated(field(10, ""), kFarTooMany)),           // StyleModel.more
           field(kStyle, field(1, repeated(field(2, ""), kFarTooMany))),  // PoseSpace.joint
           repeated(field(kStyle, ""), kFarTooMany),                      // one merged message
           repeated(std::string{15 << 3, 0}, kFarTooMany),                // an unknown number
           field(kGesture, field(10, std::string(kManyIntegers, '\0'))),  // named
           field(kGesture, field(kTree, field(1, std::string(kManyIntegers, '\1')))),  // question
           field(kStyle,
                 field(1, field(15, repeated("x", 9)) + repeated(field(15, ""), kFarTooMany))),
       }) {
    const auto file = opened(payload);
    REQUIRE_FALSE(file.has_value());
    CHECK(file.error().message.find(kRefusal) != std::string::npos);
  }
}

TEST_CASE("The largest model that can be trained is no file of too many fields", "[model_file]") {
  v1::ModelFile file;
  v1::GestureModel& gesture = *file.mutable_gesture();
  for (int i = 0; i < 1'000; ++i) {
    v1::GestureLabel& label = *gesture.add_label();
    label.set_name("g" + std::to_string(i));
    label.set_trained(true);
    for (int group = 0; group < 16; ++group) label.add_finger_class(2);
  }
  for (int i = 0; i < 16; ++i) gesture.add_group()->set_joints(3);
  for (int i = 0; i < 55; ++i) gesture.mutable_space()->add_joint("joint");
  for (int i = 0; i < 5 * 16; ++i) {
    v1::GestureTree& tree = *gesture.add_tree();
    for (int node = 0; node < 4'000; ++node) {
      tree.add_question(-1), tree.add_yes(-1), tree.add_no(-1), tree.add_leaf(-1);
    }
    for (int value = 0; value < 30'000; ++value) tree.add_mean(0.1), tree.add_variance(0.1);
  }
  CHECK(opened(file.SerializeAsString()).has_value());
}

TEST_CASE("A payload that is no message is refused", "[model_file]") {
  for (const std::string payload : {"\x1a\x05", "\x07", "\x1b", "\x1a\x02\x1a\x05"}) {
    const auto file = opened(payload);
    REQUIRE_FALSE(file.has_value());
    CHECK(file.error().message.find("cannot be read") != std::string::npos);
  }
}
