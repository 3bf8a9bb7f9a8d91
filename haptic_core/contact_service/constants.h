// Every tuned number of this room, with its unit and why it is as large as it is.
#pragma once

namespace farfeel::contact_service {

// What a contact says of itself (contact_service.cpp).
/// A textured contact's linearisation holds for a fraction of a ridge; beyond it only says which way is out.
inline constexpr double kTexturedRange_m = 0.25e-3;
/// Points of two patches that are nearer than this, and push the same way, begin to be one place: the witness of a face
/// lies anywhere on it, and faces of the benchmark's models are some millimetres wide.
inline constexpr double kSamePlace_m = 4e-3;
/// Where coarse pieces and points have more of a contact than this, the field's second derivative is not that of what
/// is felt.
inline constexpr double kLittle = 0.1;
/// Time between two answers never counts as more: after a pause patches may go where they like.
inline constexpr double kLongestStep_s = 0.1;

// Where depths are looked up (proxy.cpp).
/// Of the speculative distance: contacts farther ahead may be unknown, because relief stands up to the rest of it above
/// the coarse pieces.
inline constexpr double kKnownShare = 0.8;
/// How fast the proxy goes where the tool does not: back before a hand notices, and slow enough that what is felt,
/// which changes by the surfaces' turning along the way, changes by little in a tick.
inline constexpr double kCatchUp_m_per_s = 0.05;
/// A way in one answer that is longer was not seen: the tool was put somewhere else, or nobody looked for so long that
/// a hand may have gone around anything.
inline constexpr double kLongestWay_m = 0.06;
inline constexpr int kRounds = 24;             ///< of Hildreth's method; ten rows settle in fewer
inline constexpr double kAllowed_m = 1e-9;     ///< a row that is over by less is met
inline constexpr double kLeastSlope2 = 1e-6;   ///< a contact that translation hardly changes holds no place back
inline constexpr double kLongestTool_m = 0.1;  ///< a turn moves no point that touches by more than so much a radian

}  // namespace farfeel::contact_service
