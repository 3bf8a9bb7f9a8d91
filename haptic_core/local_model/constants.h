// Every tuned number of this room, with its unit and why it is as large as it is.
#pragma once

#include <cstddef>
#include <cstdint>

namespace farfeel::local_model {

// How old answers may be (news_age.h, local_model.cpp). The excess is what they are older than the lane makes them.
inline constexpr double kHeldAfter_s = 0.05;       ///< of excess: geometry is held, and a held wrench begins to fade
inline constexpr double kFadingAfter_s = 0.25;     ///< of excess: force fades, and nothing is taken over any more
inline constexpr double kAgesWindow_s = 2;         ///< a lane that has become longer is believed after so long
inline constexpr double kMostRoundTrip_s = 1;      ///< no lane takes longer; a satellite's takes 0.6 s
inline constexpr double kLongestSilence_s = 0.25;  ///< a longer gap counts as this: answers come at 20 Hz at least

// What is received (received_contact.cpp).
inline constexpr double kMostDepth_m = 1;              ///< a deeper contact is an error
inline constexpr double kMostStiffness_N_per_m = 1e6;  ///< far stiffer than any device renders
inline constexpr double kMostDamping_Ns_per_m = 1e4;   ///< the same for damping
inline constexpr double kMostFriction = 10;            ///< the same for friction
inline constexpr double kMostGradient = 1e15;          ///< walls may have any slope, which kMaxSlope bounds
inline constexpr double kUnitSlack = 1e-3;             ///< a direction's length differs from one by rounding alone
/// A steeper slope is a wall beside the contact. Followed, it would make k (1 + slope^2) of a stiffness k.
inline constexpr double kMaxSlope = 2;
inline constexpr double kMaxCouple_m = 0.1;  ///< no tool's arm is longer
/// Answers younger than kYoung_s are followed at once. Older ones are followed with a time constant of what they are
/// older, at most kSlowestNews_s: a nut of 100 g on its bolt hears its own swing of 37 Hz 200 ms later, and a seventh
/// of that swing is left at 30 ms.
inline constexpr double kYoung_s = 0.01, kSlowestNews_s = 0.03;
/// Two answers tell how the slope turns between them where the tool has come farther than rounding, where the contact
/// is texture (its range is short: edges and corners turn otherwise), and for so many ways beyond, because a tool that
/// has just turned back goes farther than it came.
inline constexpr double kLeastSeenWay_m = 1e-6, kTexture_m = 1e-3, kTurnsOn = 2;

// Which contact is which (match.cpp, felt_once.cpp, kept_tangents.cpp).
/// Two contacts speak of one contact where their points are this near in the tool, and their directions within 60
/// degrees. A line or a face that lies on another has its point anywhere along it.
inline constexpr double kSamePlace_m = 0.02, kSameDirection = 0.5;
inline constexpr double kSameSpot_m = 2e-3;      ///< texture moves a contact's point by less, and torque hardly changes
inline constexpr double kSameSideCosine = 0.94;  ///< 20 degrees: beyond, it is another side of the tool
/// A contact with another name goes on as the same where its point is so near, or else where it alone is there and is
/// as deep.
inline constexpr double kRenamedRange_m = 0.003, kRenamedDepth_m = 50e-6;
inline constexpr double kSuccessorsGap_m = 1e-3;  ///< what is farther apart has no force to go on with
/// A softer one is no successor: where two contacts find one place the remote lets one of them fade, and a whole force
/// on what hardly resists would be metres deep.
inline constexpr double kLeastStiffnessLeft = 0.5;
/// Two searches of one contact agree to this, their soft widths included.
inline constexpr double kFoundSlack_m = 20e-6;
/// What is pressed in deeper cannot be out of reach in the next answer while its point has moved by less along the
/// surface: contacts are told of from farther away than both.
inline constexpr double kLostDeep_m = 1e-3, kLostWay_m = 1e-3;

// How a change is let in (transition.cpp). Forces are of all contacts together: a hand feels their sum.
inline constexpr double kBleed_s = 0.01;          ///< time constant of what is let in or let go: some 20 ms in all
inline constexpr double kBleed_N_per_s = 100;     ///< the fastest that force is let in
inline constexpr double kFreeStep_N = 0.1;        ///< force that one update may change at once; a hand hardly feels it
inline constexpr double kSlopeStep_N = 0.2;       ///< the same for force across the direction, in a tick or update
inline constexpr double kTorqueStep_Nm = 0.005;   ///< torque that points which jump may change in a tick
inline constexpr double kSamePointSnap_m = 2e-4;  ///< a point that moved by less is taken over at once
inline constexpr double kSameDirectionSnap_rad = 0.005;  ///< the same for a direction
inline constexpr double kDone_m = 1e-8;                  ///< of a depth: the last of it is let in at once
inline constexpr double kLeastForce_N = 1e-9;            ///< below, a share of a force is no number
inline constexpr double kLeastChange_N = 1e-12;          ///< the same for a change
/// A depth may leave its linearisation by so much of the way that its point went: a slope that changed by one. Textures
/// stay below, and what goes further has become another place.
inline constexpr double kSurprisePerWay = 1;
inline constexpr double kSurprise_J = 0.001;  ///< debt that depths may make which no linearisation promised
inline constexpr double kEveryTick = 1.5;     ///< ticks between answers: up to so many, nothing is guessed between them

// How a contact leaves (transition.cpp).
inline constexpr double kLeaving = 1.5;       ///< times kBleed_s: slower than the one that may take its place comes
inline constexpr double kSoonGone_N = 0.3;    ///< contacts that leave with less in sum are hardly felt as they go
inline constexpr double kLeave_N_per_s = 80;  ///< they leave so fast at least; others may be back in a moment
inline constexpr double kGone = 1e-3;         ///< share of a stiffness that nobody feels any more
inline constexpr double kFade_s = 0.1;        ///< from full to no stiffness where nothing is heard
inline constexpr double kSlowestFade = 0.4;   ///< times kFade_s: time constant of a force, however deep a hand sinks

// What a step needs to know (contact_response.cpp).
inline constexpr double kMaxPaybackDamping_Ns_per_m = 5;  ///< that a debt of the tank asks for; more would feel sticky
inline constexpr double kStillWay_m = 4e-6;  ///< less way in a tick is rest, where damping counts; twice is a stroke
/// Of critical damping, of the tool on a contact that the oldest answers tell of: they answer a swing when that is
/// over, and with the contact's own damping alone it would go on for ever.
inline constexpr double kDampedWhenOld = 0.25;
/// Of m / dt^2: a stiffness that a step holds which does not know it. From 4 on no step holds.
inline constexpr double kHeldOfMass = 0.25;

// Contacts as rows (model_rows.cpp).
inline constexpr double kLeastRow_N_per_m = 1e-3;  ///< what fades further is none: 1 / k has to stay a number
/// A surface farther from the proxy is not reached within a tick: a hand's fastest jab goes 5 mm in one of 1 kHz.
inline constexpr double kReach_m = 0.006;
/// The proxy is on a surface at once that is told this much higher than it is felt, and no higher: a depth that is
/// absurd would take it away from all that it touches. Steps of real surfaces under a tool are smaller.
inline constexpr double kMostUnfelt_m = 0.005;
/// Sweeps over known surfaces that the place of the next look is kept out of; three walls at a corner need no more.
inline constexpr int kSweeps = 3;

// What was told before (kept_tangents.cpp).
inline constexpr std::size_t kMostKept = 4;  ///< with the newest, more than the corners of a face
/// Of the maximum: far less than a hand feels, and so wide that a tool goes from one side to the other in some steps.
inline constexpr double kKeptWidth_m = 50e-6;
/// Gradients that differ by more are of two flanks of a groove, where both push: a nut that knows the one alone goes
/// over its bolt's thread within a round trip.
inline constexpr double kOtherFlank = 0.5;
/// A kept tangent holds for a fraction of a ridge along the surface, which then is taken to fall away, less steeply
/// than textures do. Steep flanks are climbed: they hold as far as they were meant to.
inline constexpr double kKeptRange_m = 0.25e-3, kFall = 0.25, kSteep = 0.25;
/// Of its range: a kept tangent stays where it was told while the tool is within, and has the rest for what comes.
inline constexpr double kStaysWithin = 0.5;
inline constexpr double kTooLow_m = 1e-3;    ///< below the newest: the tool would have to tilt by much to feel it again
inline constexpr double kSaysMore_m = 5e-6;  ///< more than rounding and the soft maximum's own width make

// How a gradient is seen to turn (seen_curvature.cpp).
inline constexpr double kArm_m = 0.01;            ///< makes lengths of rotations: a small tool's
inline constexpr double kLeastTurnWay_m = 50e-9;  ///< below, a turn is rounding
inline constexpr double kForgotten_m = 200e-6;    ///< way after which a third is left: a fraction of a ridge
inline constexpr double kLeastCosine =
    0.1;  ///< a gradient that turns across the way says little of the curvature along

// What a tick may cost (local_contacts.cpp, tile_cache.cpp).
inline constexpr std::uint32_t kTilesATick = 4;     ///< taking one over costs some microseconds
inline constexpr std::uint32_t kSearchesATick = 2;  ///< of contacts: each costs some tens of microseconds
inline constexpr std::size_t kQueuedTiles = 256;    ///< half a megabyte: a second's worth at the rate of the bulk lane

}  // namespace farfeel::local_model
