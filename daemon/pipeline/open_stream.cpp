#include "daemon/pipeline/open_stream.hpp"

#include <fstream>
#include <iterator>

namespace posed::pipeline {
namespace {

Result<std::string> load_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) return fail("cannot read this file", path);
  return bytes;
}

}  // namespace

std::unexpected<Error> of_stream(const std::string& name, Error error) {
  error.message = "stream '" + name + "': " + error.message;
  return std::unexpected(std::move(error));
}

Result<std::unique_ptr<OpenStream>> open_stream(const StreamConfig& config) {
  const drivers::Driver* driver = drivers::find_driver(config.driver);
  if (driver == nullptr) {
    return of_stream(config.name, misuse("there is no driver '" + config.driver + "'").error());
  }
  auto device = driver->open(config.options);
  if (!device) return of_stream(config.name, device.error());
  auto stream = std::make_unique<OpenStream>();
  stream->config = config;
  stream->device = std::move(*device);
  if (!config.style) return stream;
  auto bytes = load_bytes(config.style->model);
  if (!bytes) return of_stream(config.name, bytes.error());
  stream->model_file = std::move(*bytes);
  return stream;
}

Result<std::unique_ptr<const style::BoundModel>> bind_style(const OpenStream& stream) {
  if (!stream.config.style) return nullptr;
  if (!stream.device.description.skeleton) {
    const std::string what =
        "driver '" + stream.config.driver + "' gives no poses, so it cannot be styled";
    return of_stream(stream.config.name, misuse(what).error());
  }
  const std::filesystem::path& path = stream.config.style->model;
  const auto model = style::parse_model(std::as_bytes(std::span(stream.model_file)), path);
  if (!model) return of_stream(stream.config.name, model.error());
  auto bound = style::bind_model(*model, *stream.device.description.skeleton,
                                 stream.config.style->filter, path.filename());
  if (!bound) return of_stream(stream.config.name, bound.error());
  return bound;
}

}  // namespace posed::pipeline
