// The report's pictures: the scene with the tool and its contact forces, at one moment of the session.
#pragma once

#include <span>
#include <string>

#include "codecs/scene/scene_description.h"
#include "haptic_core/motion/moving_objects.h"
#include "master_station/report/session_recorder.h"

namespace farfeel::master_station {

/// Writes the scene's and the contacts' picture into the folder under the names report_page.h gives, or, where nothing
/// can be drawn, a note that says why. Takes seconds where OpenGL is software; call it after the session.
void write_pictures(const std::string& folder, const codecs::SceneDescription& scene,
                    std::span<const motion::ObjectCourse> courses, const Moment& moment);

}  // namespace farfeel::master_station
