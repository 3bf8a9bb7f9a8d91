#include "slave_sim/recording/answer_fields.h"

#include <cstring>

#include "haptic_core/penetration/back_end.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::slave_sim {
namespace {

using contact_service::ContactOptions;
using contact_service::ToolPose;

enum class RecordedBackEnd : std::uint8_t { kSimd = 0, kHistorical = 3 };  // as files have it

template <typename Options, typename Visit>
void each_field(Options& options, Visit&& visit) {
  visit("service.tolerance_m", options.tolerance_m);
  visit("service.grid_samples", options.grid_samples);
  visit("service.soft_width_m", options.soft_width_m);
  visit("service.most_stiffness_N_per_m", options.most_stiffness_N_per_m);
  visit("service.most_searches", options.most_searches);
}

template <typename Pose, typename Visit>
void each_input(Pose& pose, Visit&& visit) {
  visit("sequence", pose.sequence);
  visit("time_ns", pose.time_ns);
  visit("X_WT", pose.X_WT);
  visit("V_WT_W", pose.V_WT_W);
  visit("wants_curvature", pose.wants_curvature);
}

constexpr std::size_t kEditBytes = 12 + sizeof(geometry::HeightTile::coefficients);

}  // namespace

codecs::Numbers numbers_of(const RecordedOptions& recorded) {
  codecs::NumberWriter writer;
  each_field(recorded.options, writer);
  writer("service.back_end", recorded.is_historical ? RecordedBackEnd::kHistorical : RecordedBackEnd::kSimd);
  return std::move(writer.numbers());
}

tl::expected<RecordedOptions, std::string> options_in(codecs::NumberReader& read) {
  RecordedOptions recorded;
  each_field(recorded.options, read);
  auto back_end = RecordedBackEnd::kSimd;
  read("service.back_end", back_end);
  recorded.is_historical = back_end == RecordedBackEnd::kHistorical;
  const ContactOptions& options = recorded.options;
  const bool are_sane = options.tolerance_m > 0 && options.tolerance_m < 1 && options.soft_width_m >= 0 &&
                        options.soft_width_m < 1 && options.most_stiffness_N_per_m >= 0 && options.grid_samples > 0 &&
                        options.grid_samples <= penetration::kMaxSamples;  // false for NaN
  if (!are_sane) return tl::unexpected(std::string("a contact service's settings are absurd"));
  return recorded;
}

codecs::Numbers numbers_of(const ToolPose& pose) {
  codecs::NumberWriter writer;
  each_input(pose, writer);
  return std::move(writer.numbers());
}

ToolPose pose_in(const codecs::Stream& stream, const codecs::Record& record) {
  ToolPose pose;
  codecs::NumberReader read(stream.inputs, record.inputs);
  each_input(pose, read);
  return pose;
}

codecs::RecordedMessage message_of(const SurfaceEdit& edit) {
  codecs::RecordedMessage message{kEdit, std::vector<std::byte>(kEditBytes)};
  transport::ByteWriter w(message.bytes);
  w.u32(edit.where.surface), w.u32(edit.where.tile), w.u32(edit.tile.version);
  w.bytes(std::as_bytes(std::span(edit.tile.coefficients)));
  return message;
}

tl::expected<SurfaceEdit, std::string> edit_in(const codecs::RecordedMessage& message) {
  if (message.kind != kEdit || message.bytes.size() != kEditBytes)
    return tl::unexpected(std::string("an answer's message is no edit"));
  transport::ByteReader r(message.bytes);
  SurfaceEdit edit;
  edit.where.surface = r.u32(), edit.where.tile = r.u32(), edit.tile.version = r.u32();
  const auto coefficients = r.bytes(sizeof edit.tile.coefficients);
  std::memcpy(edit.tile.coefficients.data(), coefficients.data(), coefficients.size());
  return edit;
}

codecs::Outputs AnswerOutputs::of(const contact_service::Answer& set, const ToolPose& asked) {
  std::map<std::uint32_t, double> names;
  codecs::Output called{"contacts' names", {}}, objects{"contacts' objects", {}}, points{"contacts' points p_WC_W", {}},
      directions{"contacts' directions nhat_ST_W", {}}, depths{"contacts' depths", {}},
      gradients{"contacts' gradients", {}}, doubts{"contacts' doubts", {}}, ranges{"contacts' lateral ranges", {}},
      materials{"contacts' materials", {}}, curvatures{"contacts' curvatures", {}};
  const auto add = [](codecs::Output& to, const auto& field) {
    codecs::each_number(
        "", field, [&to](const std::string&, const auto& value) { to.values.push_back(static_cast<double>(value)); });
  };
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    const auto known = names_.find(c.id.number);
    add(called, names[c.id.number] = known == names_.end() ? ++named_ : known->second);
    add(objects, c.object), add(points, c.p_WC_W), add(directions, c.nhat_ST_W), add(depths, c.depth_m);
    add(gradients, spatial::twist_from(c.gradient)), add(doubts, c.doubts), add(ranges, c.lateral_range_m);
    add(materials, c.material.stiffness_N_per_m), add(materials, c.material.damping_Ns_per_m);
    add(materials, c.material.static_friction), add(materials, c.material.dynamic_friction);
    add(curvatures, c.curvature.is_known);
    if (c.curvature.is_known)
      for (const float entry : c.curvature.upper) add(curvatures, entry);
  }
  names_ = std::move(names);
  codecs::Output pairs{"pairs_near", {}}, wrench{"sum F_To_W", {}}, proxy{"proxy X_WT", {}}, widest{"widest_m", {}};
  add(pairs, set.pairs_near), add(wrench, set.F_To_W), add(proxy, set.at_proxy(asked).X_WT);
  add(widest, set.times.widest_m);
  return {pairs,  called, objects,   points,     directions, depths, gradients,
          doubts, ranges, materials, curvatures, wrench,     proxy,  widest};
}

}  // namespace farfeel::slave_sim
