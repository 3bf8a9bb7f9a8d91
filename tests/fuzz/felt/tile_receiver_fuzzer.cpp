// Any bytes as tile messages, one after the other (u16 length, payload): the receiver stays within its bounds.
#include "master_station/session/tile_receiver.h"

namespace {

farfeel::contact_service::FeltScene one_tile_each() {
  farfeel::contact_service::FeltScene scene;
  for (int i = 0; i < 2; ++i) {
    farfeel::contact_service::FeltBody& body = scene.bodies.emplace_back();
    body.surface.coarse.positions_O = {{0, 0, 0}, {1e-3, 0, 0}, {0, 1e-3, 0}};
    body.surface.coarse.triangles = {{0, 1, 2}};
    body.surface.triangle_piece = {0};
    body.surface.triangle_chart = {0};
    body.surface.piece_count = 1;
    body.surface.charts = {{.X_OH = {}, .texel_m = 1e-4, .columns = 20, .rows = 20, .first_tile = 0}};
    body.surface.tiles.resize(1);
    body.limits = {{{}}, {0}};
  }
  return scene;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  local_model::TileCache cache(one_tile_each());
  master_station::TileReceiver receiver(cache);
  auto rest = std::as_bytes(std::span(data, size));
  while (rest.size() >= 2) {
    const std::size_t length = std::to_integer<std::size_t>(rest[0]) | std::to_integer<std::size_t>(rest[1]) << 8;
    rest = rest.subspan(2);
    const auto payload = rest.first(std::min(length, rest.size()));
    receiver.on_tile(payload);
    rest = rest.subspan(payload.size());
    receiver.put_waiting();
    cache.take_arrived(1);
  }
  return 0;
}
