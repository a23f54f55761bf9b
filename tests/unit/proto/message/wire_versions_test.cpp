// The wire, log and model messages beside those of every released version: a client of an old
// version must understand what this one sends. tests/golden/versions/*/wire.binpb is what
// `protoc --include_imports --descriptor_set_out` wrote at the release.
#include <filesystem>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <catch2/catch.hpp>

#include "posed/v1/control.pb.h"
#include "posed/v1/log.pb.h"
#include "posed/v1/model.pb.h"
#include "posed/v1/posed.pb.h"
#include "tests/support/file_text.hpp"
#include "tests/support/shared.hpp"

namespace posed::message {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;

// One sentence for each field that an old reader would miss or misread.
class Differences {
 public:
  explicit Differences(const DescriptorPool& now) : now_(now) {}

  void compare(const Descriptor& old) {
    const Descriptor* const message = now_.FindMessageTypeByName(old.full_name());
    if (message == nullptr) return add(old.full_name() + " is gone");
    for (int i = 0; i < old.field_count(); ++i) compare(*old.field(i), *message);
    for (int i = 0; i < old.nested_type_count(); ++i) compare(*old.nested_type(i));
    for (int i = 0; i < old.enum_type_count(); ++i) compare(*old.enum_type(i));
  }

  void compare(const EnumDescriptor& old) {
    const EnumDescriptor* const now = now_.FindEnumTypeByName(old.full_name());
    if (now == nullptr) return add(old.full_name() + " is gone");
    for (int i = 0; i < old.value_count(); ++i) {
      const auto* const value = now->FindValueByNumber(old.value(i)->number());
      if (value == nullptr || value->name() != old.value(i)->name()) {
        add(old.value(i)->full_name() + " is gone");
      }
    }
  }

  [[nodiscard]] const std::vector<std::string>& found() const { return found_; }

 private:
  void compare(const FieldDescriptor& old, const Descriptor& message) {
    const FieldDescriptor* const now = message.FindFieldByNumber(old.number());
    if (now == nullptr || now->name() != old.name()) return add(old.full_name() + " is gone");
    const bool same_message = old.message_type() == nullptr ||
                              (now->message_type() != nullptr &&
                               old.message_type()->full_name() == now->message_type()->full_name());
    if (now->type() != old.type() || now->is_repeated() != old.is_repeated() || !same_message) {
      add(old.full_name() + " has another type");
    }
  }
  void add(std::string difference) { found_.push_back(std::move(difference)); }

  const DescriptorPool& now_;
  std::vector<std::string> found_;
};

std::vector<std::string> differences(const google::protobuf::FileDescriptorSet& old,
                                     const DescriptorPool& now) {
  DescriptorPool pool;
  Differences differences(now);
  for (const auto& proto : old.file()) {
    const auto* const file = pool.BuildFile(proto);
    REQUIRE(file != nullptr);
    for (int i = 0; i < file->message_type_count(); ++i)
      differences.compare(*file->message_type(i));
    for (int i = 0; i < file->enum_type_count(); ++i) differences.compare(*file->enum_type(i));
  }
  return differences.found();
}

google::protobuf::FileDescriptorSet messages_of(const std::filesystem::path& version) {
  google::protobuf::FileDescriptorSet messages;
  REQUIRE(messages.ParseFromString(test::file_text(version / "wire.binpb")));
  return messages;
}

}  // namespace

TEST_CASE("no field of a released version is gone or has another type") {
  // A file of messages is known once one of its messages is used.
  for (const Descriptor* used : {v1::Frame::descriptor(), v1::ControlRequest::descriptor(),
                                 v1::DecisionValue::descriptor(), v1::ModelFile::descriptor()}) {
    REQUIRE(used != nullptr);
  }
  int versions = 0;
  for (const auto& version : std::filesystem::directory_iterator(test::golden("versions"))) {
    INFO(version.path().string());
    const auto messages = messages_of(version.path());
    CHECK(messages.file_size() >= 4);
    CHECK(differences(messages, *DescriptorPool::generated_pool()) == std::vector<std::string>{});
    ++versions;
  }
  CHECK(versions > 0);
}

TEST_CASE("a field that is removed, renamed or of another type is found") {
  const auto released = messages_of(test::golden("versions/0.1.0"));
  auto changed = released;
  for (auto& file : *changed.mutable_file()) {
    for (auto& message : *file.mutable_message_type()) {
      if (message.name() != "Matrix") continue;
      message.mutable_field(0)->set_name("row_count");
      message.mutable_field(1)->set_type(google::protobuf::FieldDescriptorProto::TYPE_INT64);
      message.mutable_field()->RemoveLast();
    }
  }
  DescriptorPool now;
  for (const auto& file : changed.file()) REQUIRE(now.BuildFile(file) != nullptr);
  CHECK(differences(released, now) ==
        std::vector<std::string>{"posed.v1.Matrix.rows is gone",
                                 "posed.v1.Matrix.columns has another type",
                                 "posed.v1.Matrix.value is gone"});
}

}  // namespace posed::message
