// The scene as it is now, and all that changes it: the edits that its file asks for at their times, and those that
// people ask for while it lives. One place, so that each change is worked out from what the last one left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "slave_sim/edits/stamp.h"
#include "slave_sim/living/journal.h"
#include "slave_sim/session/slave_session.h"
#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {

class LivingScene {
 public:
  using Say = std::function<void(const std::string&)>;
  /// Gives the surfaces of the world that may be stamped room for it, before anybody copies them, and tries the edits
  /// of the timeline. Fails where a stamp of those cannot be, and says what could. The world must outlive it, and its
  /// surfaces are what is now from here on.
  [[nodiscard]] static tl::expected<LivingScene, SceneError> of(World& world);

  /// The edits that the journal holds are made again, and those to come are kept there. Nothing was begun in it, and it
  /// must outlive the scene. warn: told, by the journal's thread, when they are kept no more.
  [[nodiscard]] tl::expected<void, SceneError> keep_in(Journal& journal, const Say& warn);

  /// Before any edit: versions of tiles between which, and those that are there, all that will come lies: for bounds on
  /// heights.
  [[nodiscard]] std::vector<SurfaceEdit> tiles_to_come() const;

  /// All that is not as in the beginning.
  struct Changes {
    std::vector<SurfaceEdit> tiles;
    std::vector<ObjectChange> objects;
  };
  [[nodiscard]] Changes changes() const;

  /// Makes the edits that are due and those that are asked for, until it is stopped: a thread of its own. say: a line
  /// for each. halve_at_s: so long after the first master came, every texture is halved; negative: never.
  void run(const std::stop_token&, SlaveSession&, double halve_at_s, const Say& say);

  /// Makes one edit, in the session if there is one. What was done, or why it cannot be.
  [[nodiscard]] tl::expected<std::string, std::string> edit(const TimedEdit&, SlaveSession*);
  /// The same of a request, but for what its number had been answered before, which is answered so again.
  [[nodiscard]] codecs::EditAnswer answer(const EditQuestion&, SlaveSession*);
  [[nodiscard]] std::uint32_t version() const { return version_; }
  /// The scene as it is now, as files (saved_files.h), which are made once for as long as it does not change. They take
  /// a fifth of this thread's time at most: who asks sooner is told to ask again.
  [[nodiscard]] Saved save(std::uint64_t number);

 private:
  struct Object {
    bool is_there = true, was_there = true;  // now, and in the beginning
    spatial::Pose X_begin_WO;
    std::map<std::uint32_t, geometry::HeightTile> originals{};  // of tiles that were changed
  };
  explicit LivingScene(World& world);
  /// How much lower than its room lets it the object would get somewhere; 0: nowhere.
  [[nodiscard]] double beyond_room_m(std::uint32_t object, const std::vector<SurfaceEdit>&) const;
  void take(const std::vector<SurfaceEdit>&, SlaveSession*);
  void place(std::uint32_t object, const std::optional<spatial::Pose>& X_WM, double takes_s, bool is_there,
             SlaveSession*);
  void revert(std::uint32_t object, SlaveSession*);
  void halve_textures(SlaveSession&);
  [[nodiscard]] tl::expected<TimedEdit, std::string> meant(const codecs::EditRequest&, bool is_again) const;
  void tell(SlaveSession&, const std::string& words, const Say&);
  void tell_what_is_durable(SlaveSession&);
  void keep(const transport::Key32& key, const codecs::EditRequest&);
  [[nodiscard]] std::optional<std::string> make_again(const JournalEntry&);
  void remember(const transport::Key32& key, const codecs::EditAnswer&);
  [[nodiscard]] std::uint32_t durable_version() const { return journal_ ? journal_->durable_version() : 0; }

  World* world_;
  Journal* journal_ = nullptr;
  std::vector<double> rooms_m_;  // of each object: how much lower than in the beginning its heights may get
  std::vector<Object> objects_;  // as in the world
  std::vector<SurfaceEdit> of_timeline_;
  std::size_t next_ = 0;  // of the timeline
  std::uint32_t version_ = 0;
  std::uint64_t changes_ = 0;  // of surfaces and places
  struct Kept {
    std::uint64_t changes = 0;  // then
    Saved saved;
    std::int64_t again_ns = 0;  // not before
  };
  std::optional<Kept> kept_;
  codecs::SceneNews told_;
  using Asked = std::pair<transport::Key32, std::uint64_t>;
  std::map<Asked, codecs::EditAnswer> answered_;
  std::deque<Asked> answered_in_order_;  // the oldest are forgotten
};

}  // namespace farfeel::slave_sim
