// Model files, each read once and bound once to each skeleton: the bodies of a source share them,
// and a file that changes while the daemon runs changes no stream. Cold; one thread at a time.
#pragma once

#include <algorithm>
#include <cassert>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/stage_type.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/same_skeleton.hpp"
#include "proto/model/model_file.hpp"

namespace posed::devices {

using ModelBytes = std::shared_ptr<const std::string>;

class ModelFiles {
 public:
  Result<ModelBytes> load(const std::filesystem::path& path) {
    ModelBytes& bytes = bytes_[path];
    if (bytes) return bytes;
    auto read = TRY(model_file::load(path));
    bytes = std::make_shared<const std::string>(std::move(read));
    return bytes;
  }

  // What `type` binds from the file for this stream. Streams of people of one size share it for as
  // long as one of them is there, so that sixty who come at once cost the time of one.
  Result<std::shared_ptr<const StageModel>> bind(const StageType& type, const ModelBytes& file,
                                                 const StageContext& context,
                                                 const std::string& name) {
    assert(file);
    std::erase_if(bound_, [](const Bound& bound) { return bound.model.expired(); });
    const auto same = std::ranges::find_if(bound_, [&](const Bound& bound) {
      return bound.type == &type && bound.file == file && bound.name == name &&
             bound.rate_hz == context.rate_hz &&
             same_skeleton(bound.skeleton.get(), context.skeleton.get());
    });
    if (same != bound_.end()) return same->model.lock();
    std::shared_ptr<const StageModel> model =
        TRY(type.bind_model(std::as_bytes(std::span(*file)), context, name));
    bound_.push_back({&type, file, name, context.rate_hz, context.skeleton, model});
    return model;
  }

 private:
  struct Bound {
    const StageType* type;
    ModelBytes file;
    std::string name;
    double rate_hz;
    std::shared_ptr<const Skeleton> skeleton;
    std::weak_ptr<const StageModel> model;
  };

  std::map<std::filesystem::path, ModelBytes> bytes_;
  std::vector<Bound> bound_;
};

}  // namespace posed::devices
