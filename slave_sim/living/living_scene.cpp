#include "slave_sim/living/living_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "codecs/text/nearest_word.h"
#include "slave_sim/living/saved_files.h"

namespace farfeel::slave_sim {
namespace {

using Kind = TimedEdit::Kind;
using std::chrono::milliseconds;

constexpr std::size_t kAnswersKept = 1024;
constexpr std::int64_t kPauseForSaving = 4;              // of what it took
constexpr milliseconds kLookAtTime{5}, kLookAtStop{50};  // between two looks

spatial::Pose pose_of_mesh(const WorldObject& object) {
  return {{1, 0, 0, 0}, -object.asset.p_OM_O};
}

Stamp stamp_of(const WorldObject& object, const TimedEdit& edit) {
  return {spatial::transform_point(spatial::inverse(pose_of_mesh(object)), edit.place_M), edit.radius_m, edit.depth_m};
}

/// Below an object's lowest height, for stamps.
std::vector<double> rooms_below_m(const SceneDefinition& definition) {
  std::vector<double> rooms(definition.objects.size(), definition.is_editable ? definition.stamp_room_m : 0);
  for (const TimedEdit& edit : definition.timeline) {
    if (edit.kind == Kind::kStamp) rooms[edit.object] += edit.depth_m;  // stamps at one place add up
  }
  return rooms;
}

int most_lowered_steps(const geometry::HeightTile& from, const geometry::HeightTile& to) {
  int most = 0;
  for (std::size_t i = 0; i < from.coefficients.size(); ++i)
    most = std::max(most, int{from.coefficients[i]} - int{to.coefficients[i]});
  return most;
}

/// Of all that says what an edit does to it.
transport::ObjectHash hash_of(const World& world) {
  std::vector<std::byte> bytes;
  const auto add = [&bytes](const auto& values) {
    const auto more = std::as_bytes(std::span(values));
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  for (const WorldObject& object : world.objects) {
    const geometry::HapticSurface& surface = object.asset.felt;
    add(object.name);
    add(std::array{object.X_WO.p.x, object.X_WO.p.y, object.X_WO.p.z, object.X_WO.R.w, object.X_WO.R.x, object.X_WO.R.y,
                   object.X_WO.R.z, surface.scale.offset_m, surface.scale.scale_m});
    add(std::array{object.may_change, object.is_there});
    for (const glm::dvec3& p : surface.coarse.positions_O) add(std::array{p.x, p.y, p.z});
    for (const geometry::HeightTile& tile : surface.tiles) add(tile.coefficients);
    const transport::ObjectHash so_far = transport::hash_of(bytes);
    bytes.assign(so_far.begin(), so_far.end());
  }
  return transport::hash_of(bytes);
}

codecs::EditRequest request_of(const TimedEdit& edit, std::uint64_t number, const std::string& object) {
  codecs::EditRequest request;
  request.number = number;
  request.kind =
      static_cast<codecs::EditKind>(static_cast<int>(edit.kind) + static_cast<int>(codecs::EditKind::kStamp));
  request.object = object;
  request.place_M = edit.place_M;
  request.radius_m = edit.radius_m;
  request.depth_m = edit.depth_m;
  request.X_WM = edit.X_WM;
  request.takes_s = edit.takes_s;
  return request;
}

}  // namespace

LivingScene::LivingScene(World& world)
    : world_(&world), rooms_m_(world.objects.size(), world.definition.is_editable ? world.definition.stamp_room_m : 0) {
  for (const WorldObject& object : world.objects) objects_.push_back({object.is_there, object.is_there, object.X_WO});
}

tl::expected<LivingScene, SceneError> LivingScene::of(World& world) {
  const std::vector<double> below_m = rooms_below_m(world.definition);
  for (std::size_t k = 0; k < below_m.size(); ++k) {
    if (below_m[k] > 0) make_room(world.objects[k].asset.felt, below_m[k]);
  }
  LivingScene scene(world);
  std::map<std::uint32_t, geometry::HapticSurface> later;  // surfaces as they will be
  const std::vector<TimedEdit>& timeline = world.definition.timeline;
  for (std::size_t n = 0; n < timeline.size(); ++n) {
    const TimedEdit& edit = timeline[n];
    if (edit.kind != Kind::kStamp) continue;
    const WorldObject& object = world.objects[edit.object];
    geometry::HapticSurface& surface = later.try_emplace(edit.object, object.asset.felt).first->second;
    const auto tiles = stamped(surface, edit.object + 1, stamp_of(object, edit));
    if (!tiles) {
      return tl::unexpected(
          SceneError{fmt::format("edit {} of the timeline, a stamp on '{}': {}", n + 1, object.name, tiles.error())});
    }
    for (const SurfaceEdit& tile : *tiles) surface.tiles[tile.where.tile] = tile.tile;
    scene.of_timeline_.insert(scene.of_timeline_.end(), tiles->begin(), tiles->end());
  }
  for (const auto& [object, surface] : later) {
    const geometry::HapticSurface& now = world.objects[object].asset.felt;
    int most_steps = 0;
    for (std::size_t i = 0; i < now.tiles.size(); ++i)
      most_steps = std::max(most_steps, most_lowered_steps(now.tiles[i], surface.tiles[i]));
    scene.rooms_m_[object] += most_steps * now.scale.scale_m;
  }
  return scene;
}

tl::expected<void, SceneError> LivingScene::keep_in(Journal& journal, const Say& warn) {
  const auto entries = journal.begin(hash_of(*world_), warn);
  if (!entries) return tl::unexpected(SceneError{entries.error()});
  for (const JournalEntry& entry : *entries) {
    if (const auto why = make_again(entry))
      return tl::unexpected(
          SceneError{fmt::format("change {} of the scene's journal cannot be made again: {}", entry.version, *why)});
  }
  journal_ = &journal;
  return {};
}

LivingScene::Changes LivingScene::changes() const {
  Changes all;
  for (std::uint32_t k = 0; k < objects_.size(); ++k) {
    const WorldObject& now = world_->objects[k];
    const Object& was = objects_[k];
    for (const auto& [tile, original] : was.originals) all.tiles.push_back({{k + 1, tile}, now.asset.felt.tiles[tile]});
    if (now.is_there != was.was_there || now.X_WO != was.X_begin_WO)
      all.objects.push_back({.object = k, .X_WO = now.X_WO, .takes_s = 0, .is_there = now.is_there});
  }
  return all;
}

std::vector<SurfaceEdit> LivingScene::tiles_to_come() const {
  if (!world_->definition.is_editable) return of_timeline_;
  // Anything between the beginning and the same lowered by all its room.
  std::vector<SurfaceEdit> all;
  for (std::uint32_t k = 0; k < rooms_m_.size(); ++k) {
    const geometry::HapticSurface& surface = world_->objects[k].asset.felt;
    const double steps = rooms_m_[k] / surface.scale.scale_m + 1;  // one for the rounding of what is asked
    for (std::uint32_t i = 0; i < surface.tiles.size(); ++i) {
      SurfaceEdit lowered{{k + 1, i}, surface.tiles[i]};
      ++lowered.tile.version;
      for (std::uint16_t& c : lowered.tile.coefficients)
        c = static_cast<std::uint16_t>(std::max(0.0, std::floor(c - steps)));
      all.push_back(std::move(lowered));
    }
  }
  return all;
}

double LivingScene::beyond_room_m(std::uint32_t object, const std::vector<SurfaceEdit>& tiles) const {
  const geometry::HapticSurface& surface = world_->objects[object].asset.felt;
  int most_steps = 0;
  for (const SurfaceEdit& edit : tiles) {
    const auto changed = objects_[object].originals.find(edit.where.tile);
    const geometry::HeightTile& original =
        changed == objects_[object].originals.end() ? surface.tiles[edit.where.tile] : changed->second;
    most_steps = std::max(most_steps, most_lowered_steps(original, edit.tile));
  }
  return std::max(0.0, most_steps * surface.scale.scale_m - rooms_m_[object] - surface.scale.scale_m);
}

void LivingScene::take(const std::vector<SurfaceEdit>& tiles, SlaveSession* session) {
  ++changes_;
  for (const SurfaceEdit& edit : tiles) {
    const std::uint32_t object = edit.where.surface - 1;
    geometry::HeightTile& now = world_->objects[object].asset.felt.tiles[edit.where.tile];
    objects_[object].originals.try_emplace(edit.where.tile, now);
    now = edit.tile;
    if (session) session->edit(edit);
  }
}

void LivingScene::place(std::uint32_t object, const std::optional<spatial::Pose>& X_WM, double takes_s, bool is_there,
                        SlaveSession* session) {
  ++changes_;
  objects_[object].is_there = is_there;
  ObjectChange change{.object = object, .takes_s = takes_s, .is_there = is_there};
  WorldObject& now = world_->objects[object];
  if (X_WM) now.X_WO = *X_WM * pose_of_mesh(now);
  if (X_WM) change.X_WO = now.X_WO;
  now.is_there = is_there;
  if (session) session->change(change);
}

void LivingScene::revert(std::uint32_t object, SlaveSession* session) {
  WorldObject& of = world_->objects[object];
  std::vector<SurfaceEdit> back;
  for (const auto& [tile, original] : objects_[object].originals) {
    const geometry::HeightTile& now = of.asset.felt.tiles[tile];
    if (now.coefficients == original.coefficients) continue;
    back.push_back({{object + 1, tile}, original});
    back.back().tile.version = now.version + 1;
  }
  take(back, session);
  if (!of.may_change) return;
  of.X_WO = objects_[object].X_begin_WO;
  of.is_there = objects_[object].is_there = objects_[object].was_there;
  if (session) session->change({.object = object, .X_WO = of.X_WO, .is_there = of.is_there});
}

tl::expected<std::string, std::string> LivingScene::edit(const TimedEdit& edit, SlaveSession* session) {
  const WorldObject& object = world_->objects[edit.object];
  const auto cannot = [&](std::string_view why) { return tl::unexpected(fmt::format("'{}' {}", object.name, why)); };
  const bool is_there = objects_[edit.object].is_there;
  if (edit.kind != Kind::kStamp && edit.kind != Kind::kRevert && !object.may_change)
    return cannot("moves by a script, and nothing else moves it or takes it away");
  std::string words;
  switch (edit.kind) {
    case Kind::kStamp: {
      auto tiles = stamped(object.asset.felt, edit.object + 1, stamp_of(object, edit));
      if (!tiles) return cannot("cannot be stamped so: " + tiles.error());
      if (const double over_m = beyond_room_m(edit.object, *tiles); over_m > 0) {
        return cannot(fmt::format(
            "cannot be stamped so: {:.3f} mm is too deep here: where it was stamped before, {:.3f} mm may go in all "
            "(stamp_room_m); {:.3f} mm is possible",
            1e3 * edit.depth_m, 1e3 * rooms_m_[edit.object], 1e3 * std::max(0.0, edit.depth_m - over_m)));
      }
      take(*tiles, session);
      words = fmt::format("'{}' is stamped, {:.2f} mm deep", object.name, 1e3 * edit.depth_m);
      break;
    }
    case Kind::kSpawn:
      if (is_there) return cannot("is there already: it can be moved");
      place(edit.object, edit.X_WM, 0, true, session);
      words = fmt::format("'{}' comes", object.name);
      break;
    case Kind::kMove:
      if (!is_there) return cannot("is not there: it can be spawned");
      place(edit.object, edit.X_WM, edit.takes_s, true, session);
      words = fmt::format("'{}' moves for {:g} s", object.name, edit.takes_s);
      break;
    case Kind::kRemove:
      if (!is_there) return cannot("is not there");
      place(edit.object, {}, 0, false, session);
      words = fmt::format("'{}' goes", object.name);
      break;
    case Kind::kRevert:
      revert(edit.object, session);
      words = fmt::format("'{}' is as in the beginning", object.name);
      break;
  }
  ++version_;
  return words;
}

tl::expected<TimedEdit, std::string> LivingScene::meant(const codecs::EditRequest& request, bool is_again) const {
  if (!is_again && !world_->definition.is_editable)
    return tl::unexpected(
        std::string("this scene may not be changed while it lives: its file says editable = true for that, or 'farfeel "
                    "slave --editable'"));
  const auto object = std::ranges::find(world_->objects, request.object, &WorldObject::name);
  if (object == world_->objects.end()) {
    std::vector<std::string_view> names;
    for (const WorldObject& each : world_->objects) names.push_back(each.name);
    const std::string_view nearest = codecs::nearest_word(request.object, names);
    return tl::unexpected(fmt::format("there is no object '{}'{}; there are {}", request.object,
                                      nearest.empty() ? "" : fmt::format(", did you mean {}?", nearest),
                                      fmt::join(names, ", ")));
  }
  TimedEdit edit;
  edit.kind = static_cast<Kind>(static_cast<int>(request.kind) - static_cast<int>(codecs::EditKind::kStamp));
  edit.object = static_cast<std::uint32_t>(object - world_->objects.begin());
  edit.place_M = request.place_M;
  edit.radius_m = request.radius_m;
  edit.depth_m = request.depth_m;
  edit.X_WM = request.X_WM;
  edit.takes_s = request.takes_s;
  if (edit.kind == Kind::kMove && !edit.X_WM) return tl::unexpected(std::string("a move needs a place to go to"));
  if (edit.kind == Kind::kMove && edit.takes_s < motion::kShortestCourse_s)
    return tl::unexpected(fmt::format("a move takes {:g} s at least", motion::kShortestCourse_s));
  return edit;
}

void LivingScene::remember(const transport::Key32& key, const codecs::EditAnswer& answer) {
  const Asked asked{key, answer.number};
  answered_.emplace(asked, answer);
  answered_in_order_.push_back(asked);
  if (answered_in_order_.size() <= kAnswersKept) return;
  answered_.erase(answered_in_order_.front());
  answered_in_order_.pop_front();
}

void LivingScene::keep(const transport::Key32& key, const codecs::EditRequest& request) {
  if (journal_) journal_->append({key, version_, request});
}

/// Why not, if not.
std::optional<std::string> LivingScene::make_again(const JournalEntry& entry) {
  const auto wanted = meant(entry.request, true);
  if (!wanted) return wanted.error();
  const auto done = edit(*wanted, nullptr);
  if (!done) return done.error();
  if (version_ != entry.version) return fmt::format("a change is missing before it");
  if (entry.key == transport::Key32{}) {
    next_ = static_cast<std::size_t>(std::min<std::uint64_t>(entry.request.number, world_->definition.timeline.size()));
  } else {
    remember(entry.key, {entry.request.number, codecs::EditOutcome::kDone, version_, *done});
  }
  told_ = {version_, version_, *done};
  return std::nullopt;
}

codecs::EditAnswer LivingScene::answer(const EditQuestion& question, SlaveSession* session) {
  const auto with_outcome = [this](codecs::EditAnswer answer) {
    if (answer.is_done() && journal_)
      answer.outcome =
          durable_version() >= answer.version ? codecs::EditOutcome::kDurable : codecs::EditOutcome::kToBeKept;
    return answer;
  };
  if (const auto known = answered_.find({question.key, question.request.number}); known != answered_.end())
    return with_outcome(known->second);
  const auto wanted = meant(question.request, false);
  const auto done = wanted ? edit(*wanted, session) : tl::unexpected(wanted.error());
  if (done) keep(question.key, question.request);
  const codecs::EditAnswer answer{question.request.number,
                                  done ? codecs::EditOutcome::kDone : codecs::EditOutcome::kRefused, version_,
                                  done ? *done : done.error()};
  remember(question.key, answer);
  return with_outcome(answer);
}

Saved LivingScene::save(std::uint64_t number) {
  const std::int64_t now_ns = transport::monotonic_ns();
  if (!kept_ || kept_->changes != changes_) {
    if (kept_ && now_ns < kept_->again_ns)
      return {{number,
               codecs::SaveOutcome::kLater,
               0,
               {},
               fmt::format("the scene was saved a moment ago and has changed since: it is saved again in {:.1f} s",
                           1e-9 * static_cast<double>(kept_->again_ns - now_ns))},
              nullptr};
    auto files = saved_files(*world_);
    kept_ = {changes_, {{0, codecs::SaveOutcome::kRefused, version_, {}, {}}, nullptr}, 0};
    if (files) {
      kept_->saved.object = transport::make_object(*std::move(files));
      kept_->saved.answer.outcome = codecs::SaveOutcome::kOffered;
      kept_->saved.answer.hash = kept_->saved.object->hash;
    } else {
      kept_->saved.answer.words = files.error();
    }
    const std::int64_t done_ns = transport::monotonic_ns();
    kept_->again_ns = done_ns + kPauseForSaving * (done_ns - now_ns);
  }
  Saved saved = kept_->saved;
  saved.answer.number = number;
  return saved;
}

/// Each about its mean.
void LivingScene::halve_textures(SlaveSession& session) {
  for (std::uint32_t k = 0; k < world_->objects.size(); ++k) {
    const std::vector<geometry::HeightTile>& tiles = world_->objects[k].asset.felt.tiles;
    double sum = 0;
    for (const geometry::HeightTile& tile : tiles)
      for (const std::uint16_t c : tile.coefficients) sum += c;
    const double mean = tiles.empty() ? 0 : sum / static_cast<double>(tiles.size() * tiles[0].coefficients.size());
    std::vector<SurfaceEdit> halves;
    for (std::uint32_t i = 0; i < tiles.size(); ++i) {
      SurfaceEdit half{{k + 1, i}, tiles[i]};
      ++half.tile.version;
      for (std::uint16_t& c : half.tile.coefficients) c = static_cast<std::uint16_t>(std::lround(0.5 * (c + mean)));
      halves.push_back(half);
    }
    take(halves, &session);
  }
}

void LivingScene::tell(SlaveSession& session, const std::string& words, const Say& say) {
  told_ = {version_, std::min(version_, durable_version()), words};
  session.tell(told_);
  say(words);
}

void LivingScene::tell_what_is_durable(SlaveSession& session) {
  const std::uint32_t durable = std::min(version_, durable_version());
  if (durable == told_.durable) return;
  told_.durable = durable;
  session.tell(told_);
}

void LivingScene::run(const std::stop_token& stop, SlaveSession& session, double halve_at_s, const Say& say) {
  const std::vector<TimedEdit>& timeline = world_->definition.timeline;
  std::int64_t came_ns = 0;
  session.tell(told_);
  for (bool is_halved = halve_at_s < 0; !stop.stop_requested();) {
    const bool waits_for_time = !is_halved || next_ < timeline.size();
    if (const auto question = session.next_edit(waits_for_time ? kLookAtTime : kLookAtStop)) {
      const std::uint32_t before = version_;
      const codecs::EditAnswer made = answer(*question, &session);
      session.answer(*question, made);
      if (version_ != before) tell(session, fmt::format("{}, by {}", made.words, question->name), say);
    }
    if (const auto asked = session.next_save()) session.answer(*asked, save(asked->number));
    const auto scene_s = session.scene_s();
    for (; scene_s && next_ < timeline.size() && timeline[next_].at_s <= *scene_s; ++next_) {
      const auto done = edit(timeline[next_], &session);
      if (done) {
        keep({}, request_of(timeline[next_], next_ + 1, world_->objects[timeline[next_].object].name));
        tell(session, *done, say);
      } else {
        say(fmt::format("edit {} of the timeline is left out: {}", next_ + 1, done.error()));
      }
    }
    tell_what_is_durable(session);
    if (is_halved) continue;
    if (session.has_master() && came_ns == 0) came_ns = transport::monotonic_ns();
    if (came_ns == 0 || 1e-9 * static_cast<double>(transport::monotonic_ns() - came_ns) < halve_at_s) continue;
    halve_textures(session);
    tell(session, "the objects' texture is half as high from now on", say);
    is_halved = true;
  }
}

}  // namespace farfeel::slave_sim
