#include "models/style/model/style_model.hpp"

#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "models/style/model/harmonics.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/model/model_file.hpp"
#include "proto/model/validator.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr int kMaxInputs = 20'000;
constexpr int kMaxUsual = 4000;

// The numbers of a process. Training gives weights below 1e9 and variances below 1; with these even
// the sum of kMaxInputs terms, each a weight times a kernel's value, stays within the hot path's
// floats (3e38).
constexpr double kMaxWeight = 1e15;                                // rad
constexpr double kMinLogVariance = -60.0, kMaxLogVariance = 30.0;  // of rad^2
constexpr double kMaxVariance = 1e13;                              // rad^2, e^kMaxLogVariance

// How fast a mean pose changes the style that it shows: two poses apart by the noise of a float are
// the difference of two styles.
constexpr double kMaxSlope = 1e9;  // 1/rad

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Reader : public model_file::Validator {
 public:
  VectorXd vector(const google::protobuf::RepeatedField<double>& list, int size, double low,
                  double high, const char* what) {
    want(list.size() == size, what);
    if (!valid()) return {};
    numbers(list, low, high, what);
    return Eigen::Map<const VectorXd>(list.data(), size);
  }

  MatrixXd matrix(const v1::Matrix& m, int columns, double largest, const char* what) {
    const bool shaped = m.rows() >= 1 && m.rows() <= kMaxInputs &&
                        m.columns() == static_cast<std::uint32_t>(columns) &&
                        static_cast<std::int64_t>(m.rows()) * m.columns() == m.value_size();
    want(shaped, what);
    if (!valid()) return {};
    numbers(m.value(), -largest, largest, what);
    return Eigen::Map<const RowMajor>(m.value().data(), m.rows(), columns);
  }

  // Angles of a pose, or differences of two.
  VectorXd angles(const google::protobuf::RepeatedField<double>& list, int size, const char* what) {
    return vector(list, size, -kMaxAngle_rad, kMaxAngle_rad, what);
  }

  VectorXd limits(const google::protobuf::RepeatedField<double>& list, int size) {
    return vector(list, size, 0.0, kMaxAngle_rad, "the limits");
  }
};

motion::PoseSpaceSpec read_space(const v1::PoseSpace& from, Reader& reader) {
  motion::PoseSpaceSpec spec;
  const auto space = motion::space_from_name(from.name());
  reader.want(space.has_value(), "the name of the pose space");
  if (space) spec.space = *space;
  spec.joints.assign(from.joint().begin(), from.joint().end());
  reader.want(!spec.joints.empty() && spec.joints.size() <= kMaxJoints, "the number of joints");
  reader.want(
      std::set<std::string>(spec.joints.begin(), spec.joints.end()).size() == spec.joints.size(),
      "the joints' names");
  reader.want(from.root() < spec.joints.size(), "the root joint");
  spec.root = static_cast<int>(from.root());
  const auto means = spec.space == motion::Space::kCmu43 ? 0 : static_cast<int>(spec.joints.size());
  const VectorXd mean = reader.vector(from.mean_xyzw(), 4 * means, -2.0, 2.0, "the mean rotations");
  for (int j = 0; j < means && reader.valid(); ++j) {
    const Eigen::Quaterniond q(mean[4 * j + 3], mean[4 * j], mean[4 * j + 1], mean[4 * j + 2]);
    reader.want(std::abs(q.norm() - 1.0) < 1e-6, "a mean rotation, which is no unit quaternion");
    spec.mean.push_back(q);
  }
  const bool is_cmu = spec.space == motion::Space::kCmu43;
  reader.want(!is_cmu || spec.joints.size() == motion::kCmu43Joints, "the joints of cmu43");
  return spec;
}

gp::Trained read_process(const v1::GaussianProcess& from, int dims, Reader& reader) {
  gp::Trained process;
  process.inputs = reader.matrix(from.inputs(), dims, kMaxAngle_rad, "the inputs' shape or values");
  process.weights = reader.matrix(from.weights(), dims, kMaxWeight, "the weights' shape or values");
  reader.want(process.inputs.rows() == process.weights.rows(), "the number of weights");
  process.offset = reader.angles(from.offset(), dims, "the prior mean");
  process.lambda = reader.number(from.lambda(), kMinLogVariance, kMaxLogVariance, "lambda");
  process.mu = reader.number(from.mu(), 1e-12, 1e12, "mu");
  process.b = reader.number(from.b(), 0.0, kMaxVariance, "b");
  process.noise = reader.number(from.noise(), 0.0, kMaxVariance, "the noise");
  if (from.scale_size() > 0) {
    process.scale = reader.vector(from.scale(), dims, 1e-3, 1.0, "the kernel's scale");
  }
  return process;
}

MoreStyle read_style(const v1::StyleTarget& from, Eigen::Index points, int dims, Reader& reader) {
  MoreStyle style;
  style.name = from.name();
  style.function.weights = reader.matrix(from.weights(), dims, kMaxWeight, "a style's weights");
  reader.want(style.function.weights.rows() == points, "the number of a style's weights");
  style.function.offset = reader.angles(from.offset(), dims, "a style's prior mean");
  style.limit_rad = reader.limits(from.limit_rad(), dims);
  return style;
}

GateData read_gate(const v1::StyleGate& from, int dims, int joints, Reader& reader) {
  GateData gate;
  gate.neutral = reader.angles(from.neutral(), dims, "the neutral pose");
  if (from.swing_rad() == 0.0 && from.fastest_stride_s() == 0.0) return gate;
  gate.swing_rad = reader.number(from.swing_rad(), 1e-3, 10.0, "the legs' swing");
  gate.fastest_stride_s = reader.number(from.fastest_stride_s(), 0.05, 100.0, "the fastest stride");
  if (from.has_gait_correlation()) {
    gate.gait_correlation =
        reader.number(from.gait_correlation(), -1.0, 1.0, "the correlation of the gait");
  }
  reader.want(from.usual_size() <= kMaxUsual, "the number of usual walks");
  for (const v1::Matrix& cycle : from.usual()) {
    if (!reader.valid()) break;
    gate.usual.push_back(reader.matrix(cycle, dims, kMaxAngle_rad, "a usual walk"));
    reader.want(gate.usual.back().rows() == kCycleRows, "the harmonics of a usual walk");
  }
  reader.want(from.rigs_size() <= kMaxUsual, "the number of figures");
  if (reader.valid()) gate.rigs.assign(from.rigs().begin(), from.rigs().end());
  if (from.places_size() == 0) return gate;
  const VectorXd places = reader.vector(from.places(), joints, -1.0, 1.0, "the trunk's places");
  if (reader.valid()) gate.places.assign(places.begin(), places.end());
  return gate;
}

StyleAxis read_axis(const v1::StyleAxis& from, int dims, Reader& reader) {
  StyleAxis axis;
  axis.direction = reader.vector(from.direction(), dims, -kMaxSlope, kMaxSlope, "the style's axis");
  const double most = kMaxSlope * kMaxAngle_rad * dims;
  axis.offset = reader.number(from.offset(), -most, most, "the style's offset");
  return axis;
}

RootFunction read_root(const v1::StyleRoot& from, Eigen::Index points, Reader& reader) {
  constexpr double kMaxLegs = 100.0;
  RootFunction root;
  root.function.weights =
      reader.matrix(from.weights(), RootFunction::kDims, kMaxWeight, "the root's weights");
  reader.want(root.function.weights.rows() == points, "the number of the root's weights");
  root.function.offset =
      reader.vector(from.offset(), RootFunction::kDims, -kMaxLegs, kMaxLegs, "the root's mean");
  const VectorXd limit =
      reader.vector(from.limit(), RootFunction::kDims, 0.0, kMaxLegs, "the root's limits");
  if (reader.valid()) root.limit = limit;
  return root;
}

StyleModel read_model(const v1::StyleModel& from, Reader& reader) {
  StyleModel model;
  model.space = read_space(from.space(), reader);
  const int dims = motion::space_dims(model.space);
  model.process = read_process(from.process(), dims, reader);
  model.limit_rad = reader.limits(from.limit_rad(), dims);
  model.to = from.to();
  for (const v1::StyleTarget& style : from.more()) {
    if (!reader.valid()) break;
    model.more.push_back(read_style(style, model.process.inputs.rows(), dims, reader));
  }
  for (const v1::StyleRoot& root : from.root()) {
    if (!reader.valid()) break;
    model.roots.push_back(read_root(root, model.process.inputs.rows(), reader));
  }
  reader.want(model.roots.empty() || model.roots.size() == model.styles(),
              "the number of the styles' roots");
  const auto names = model.names();
  reader.want(names.size() <= kMaxStyles, "the number of styles");
  reader.want(std::set<std::string>(names.begin(), names.end()).size() == names.size(),
              "the styles' names");
  model.rate_hz = reader.number(from.rate_hz(), 1.0, 10'000.0, "the frame rate");
  model.from = from.from();
  model.report_json = from.report_json();
  if (from.has_gate()) {
    const auto joints = static_cast<int>(model.space.joints.size());
    model.gate = read_gate(from.gate(), dims, joints, reader);
  }
  if (from.has_axis()) model.axis = read_axis(from.axis(), dims, reader);
  return model;
}

void write_matrix(const MatrixXd& m, v1::Matrix& out) {
  out.set_rows(static_cast<std::uint32_t>(m.rows()));
  out.set_columns(static_cast<std::uint32_t>(m.cols()));
  const RowMajor rows = m;
  out.mutable_value()->Add(rows.data(), rows.data() + rows.size());
}

void write_vector(const VectorXd& v, google::protobuf::RepeatedField<double>& out) {
  out.Add(v.data(), v.data() + v.size());
}

}  // namespace

Result<StyleModel> parse_model(std::span<const std::byte> bytes, const std::string& name) {
  const auto file = TRY(model_file::open(bytes, name));
  if (!file.has_style()) {
    return fail("the model is not a style model; make one with `posed train style`", name);
  }
  Reader reader;
  StyleModel model = read_model(file.style(), reader);
  TRY(reader.verdict(name));
  return model;
}

Result<StyleModel> load_model(const std::filesystem::path& path) {
  const auto bytes = TRY(model_file::load(path));
  return parse_model(std::as_bytes(std::span(bytes)), path.string());
}

std::string serialize_model(const StyleModel& model) {
  v1::ModelFile file;
  v1::StyleModel& style = *file.mutable_style();
  v1::PoseSpace& space = *style.mutable_space();
  space.set_name(std::string(motion::space_name(model.space.space)));
  for (const std::string& joint : model.space.joints) space.add_joint(joint);
  for (const Eigen::Quaterniond& q : model.space.mean) {
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) space.add_mean_xyzw(value);
  }
  space.set_root(static_cast<std::uint32_t>(model.space.root));
  v1::GaussianProcess& process = *style.mutable_process();
  write_matrix(model.process.inputs, *process.mutable_inputs());
  write_matrix(model.process.weights, *process.mutable_weights());
  write_vector(model.process.offset, *process.mutable_offset());
  process.set_lambda(model.process.lambda);
  process.set_mu(model.process.mu);
  process.set_b(model.process.b);
  process.set_noise(model.process.noise);
  write_vector(model.process.scale, *process.mutable_scale());
  write_vector(model.limit_rad, *style.mutable_limit_rad());
  style.set_rate_hz(model.rate_hz);
  style.set_from(model.from);
  style.set_to(model.to);
  style.set_report_json(model.report_json);
  for (const MoreStyle& one : model.more) {
    v1::StyleTarget& target = *style.add_more();
    target.set_name(one.name);
    write_matrix(one.function.weights, *target.mutable_weights());
    write_vector(one.function.offset, *target.mutable_offset());
    write_vector(one.limit_rad, *target.mutable_limit_rad());
  }
  for (const RootFunction& one : model.roots) {
    v1::StyleRoot& root = *style.add_root();
    write_matrix(one.function.weights, *root.mutable_weights());
    write_vector(one.function.offset, *root.mutable_offset());
    write_vector(one.limit, *root.mutable_limit());
  }
  if (model.gate.present()) {
    write_vector(model.gate.neutral, *style.mutable_gate()->mutable_neutral());
    style.mutable_gate()->set_swing_rad(model.gate.swing_rad);
    style.mutable_gate()->set_fastest_stride_s(model.gate.fastest_stride_s);
    if (!std::isnan(model.gate.gait_correlation)) {
      style.mutable_gate()->set_gait_correlation(model.gate.gait_correlation);
    }
    for (const MatrixXd& cycle : model.gate.usual) {
      write_matrix(cycle, *style.mutable_gate()->add_usual());
    }
    for (const std::uint32_t rig : model.gate.rigs) style.mutable_gate()->add_rigs(rig);
    for (const double place : model.gate.places) style.mutable_gate()->add_places(place);
  }
  if (model.axis.present()) {
    write_vector(model.axis.direction, *style.mutable_axis()->mutable_direction());
    style.mutable_axis()->set_offset(model.axis.offset);
  }
  return model_file::wrap(std::move(file));
}

Result<> save_model(const StyleModel& model, const std::filesystem::path& path) {
  return model_file::save(serialize_model(model), path);
}

std::vector<std::string> StyleModel::names() const {
  std::vector<std::string> names{to};
  for (const MoreStyle& style : more) names.push_back(style.name);
  return names;
}

std::uint32_t rig_id(const Skeleton& skeleton) {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  const auto add = [&hash](std::uint32_t byte) { hash = (hash ^ byte) * 16777619U; };
  for (const Joint& joint : skeleton.joints) {
    for (const char letter : joint.name) add(static_cast<unsigned char>(letter));
    add(static_cast<std::uint32_t>(joint.parent + 1));
  }
  return hash;
}

StyleModel mixture_of(const StyleModel& model, std::span<const double> shares) {
  StyleModel mixture = model;
  mixture.more.clear();
  mixture.process.weights *= shares[0];
  mixture.process.offset *= shares[0];
  mixture.limit_rad *= shares[0];
  if (!model.roots.empty()) {
    mixture.roots.resize(1);
    RootFunction& root = mixture.roots.front();
    root.function.weights *= shares[0];
    root.function.offset *= shares[0];
    root.limit *= shares[0];
    for (std::size_t s = 1; s < model.styles(); ++s) {
      root.function.weights += shares[s] * model.roots[s].function.weights;
      root.function.offset += shares[s] * model.roots[s].function.offset;
      root.limit += shares[s] * model.roots[s].limit;
    }
  }
  for (std::size_t s = 1; s < model.styles(); ++s) {
    const MoreStyle& style = model.more[s - 1];
    mixture.process.weights += shares[s] * style.function.weights;
    mixture.process.offset += shares[s] * style.function.offset;
    mixture.limit_rad += shares[s] * style.limit_rad;
  }
  return mixture;
}

}  // namespace posed::style
