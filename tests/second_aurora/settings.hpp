// What the second emulated Aurora is made of: tools, firmware, timing, faults and what it measured. Values
// only.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tubed::second_aurora {

inline constexpr std::int64_t kMillisecond_ns = 1'000'000;
inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

// A coil in the field generator's frame; a NaN position means that the coil sees no field (MISSING).
struct Pose {
  double q0 = 1, qx = 0, qy = 0, qz = 0;
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double indicator = 0;
};

// The memory in a tool's plug, which PINIT reads.
enum class Rom {
  Programmed,  // PINIT succeeds
  Blank,       // PINIT answers ERROR13 until PVWR has written all 1,024 bytes
  Unreadable,  // PINIT answers ERROR13 whatever is written
};

struct Tool {
  std::uint32_t serial = 0x3A1B2C01;
  std::string part_number = "610001";  // 20 characters on the wire
  std::string manufacturer;            // empty: as Settings::simulated_maker says
  int main_type = 0x02;                // 02 probe, 0B catheter
  int coils = 1;                       // 5-DOF coils on this plug; 2: the second handle appears after PINIT
  Rom rom = Rom::Programmed;
  unsigned broken_coils = 0;  // bit c set: the coil of channel c is broken
};

enum class HandleOrder { Ascending, Descending, ShuffledEachReply };

// Where recordings and the guide leave room, one setting each; the default is the behaviour that is hardest
// for a client.
struct Firmware {
  std::string freeze_tag = "AURORA Rev 006";  // or 005, 008
  std::string api_revision = "D.001.005";     // D.001.004 to D.001.007
  std::string combined_revision = "013";      // VER:5
  std::string refused_rates = "6A";           // digits of COMM answered with ERROR06
  std::optional<int> bx_error;                // BX is answered with this error (0x01, 0x32)
  std::optional<int> getinfo_error;           // GETINFO is answered with this error (0x01)
  bool phinf_answers_while_tracking = false;  // otherwise ERROR0C
  bool phinf_before_pinit_is_blank = true;    // zeros and blanks; otherwise ERROR0E
  bool counter_stops_with_tstop = false;
  bool first_reply_is_missing = true;  // the first tracking reply after TSTART: MISSING, frame 0
  bool init_frees_handles = false;
  bool freed_numbers_are_reused = true;         // a new handle takes the lowest free number
  bool plug_gets_handle_while_tracking = true;  // otherwise at TSTOP
  bool works_ahead_while_sending = true;        // composes the next reply while the previous one is leaving
  HandleOrder handle_order = HandleOrder::Ascending;
  int status_before_pinit = 0x001;            // PHSR: 001 or 003
  std::uint32_t extra_port_status = 0x2000E;  // GPIO bits and bit 17 of initialised handles
};

struct Timing {
  std::int64_t boot_ns = 3 * kSecond_ns;  // power on to RESET
  std::int64_t reset_ns = 1300 * kMillisecond_ns;
  std::int64_t init_ns = 50 * kMillisecond_ns;
  std::int64_t pinit_rom_ns = 2550 * kMillisecond_ns;     // the plug's memory is read (or found blank)
  std::int64_t pinit_virtual_ns = 140 * kMillisecond_ns;  // written with PVWR, or initialised already
  std::int64_t tstart_min_ns = 1400 * kMillisecond_ns;
  std::int64_t tstart_max_ns = 2000 * kMillisecond_ns;
  std::int64_t tstop_ns = 340 * kMillisecond_ns;
  std::int64_t pvwr_ns = 30 * kMillisecond_ns;
  std::int64_t other_ns = 5 * kMillisecond_ns;
  std::int64_t tracking_reply_ns = 1 * kMillisecond_ns;  // TX, BX: command in to first byte out
  std::int64_t comm_switch_ns = 10 * kMillisecond_ns;    // last byte of OKAY to the new rate
  std::int64_t report_delay_ns = 5 * kMillisecond_ns;    // measurement to the first reply that may contain it
  std::int64_t latency_timer_ns =
      1 * kMillisecond_ns;  // USB adapter: 62 bytes or this; 0: every byte at once
  double measurements_per_second = 40.4;
};

// Coils outside are reported as out of volume.
struct Volume {
  double min_x_mm = -250, max_x_mm = 250, min_y_mm = -250, max_y_mm = 250, min_z_mm = -550, max_z_mm = -50;
  double missing_share = 207.0 / 220.0;  // of the coils outside, MISSING although 0800 asks for them
};

enum class FaultKind {
  // damage to one reply
  BodyCrcWrong,
  HeaderCrcWrong,
  LengthWrong,
  Truncated,
  ByteDropped,
  NoiseBefore,
  NoReply,
  ErrorInstead,
  Duplicated,
  Stale,
  Late,
  PauseInside,
  TextForBinary,
  SpontaneousReset,
  HangUp,
  PowerCycle,
  // damage to one measurement, or to all for a duration
  CoilMissing,
  CoilOutOfVolume,
  CoilBroken,
  PosesStuck,
  CounterStands,
  CounterJumps,
};
inline constexpr std::size_t kFaultKinds = 22;
// [kind], for those who print counts or read faults from a command line.
inline constexpr std::array<std::string_view, kFaultKinds> kFaultNames = {
    "body_crc_wrong", "header_crc_wrong", "length_wrong",       "truncated",         "byte_dropped",
    "noise_before",   "no_reply",         "error_instead",      "duplicated",        "stale",
    "late",           "pause_inside",     "text_for_binary",    "spontaneous_reset", "hang_up",
    "power_cycle",    "coil_missing",     "coil_out_of_volume", "coil_broken",       "poses_stuck",
    "counter_stands", "counter_jumps"};

enum class Strikes { TrackingReplies, AllReplies };

struct Fault {
  FaultKind kind = FaultKind::NoReply;
  double probability = 0;  // per reply, or per measurement
  int next = 0;            // strikes the next so many for certain, then by probability
  Strikes strikes = Strikes::TrackingReplies;
  std::int64_t duration_ns =
      0;  // Late, PauseInside, HangUp, PowerCycle and all of measurements; 0: the kind's default
  int parameter =
      0;  // ErrorInstead: the number; NoiseBefore: bytes; CounterJumps: measurements, may be negative;
          // coils: 1 + index among the enabled ones; 0: the kind's default, or at random
};

struct Settings {
  std::vector<std::optional<Tool>> ports{4};  // [0] is port 1
  Firmware firmware;
  Timing timing;
  Volume volume;
  std::vector<Fault> faults;
  std::uint64_t seed = 1;
  std::uint32_t first_frame = 8;  // counter at the first measurement after power on
  bool port_vanishes_without_power =
      true;                     // the USB converter is in the device; false: an RS-232 cable's stays
  bool simulated_maker = true;  // PHINF names "TUBED SIM   " as manufacturer, otherwise "NDI         "
};

enum class CoilState {
  Valid,
  Missing,
  OutOfVolume,         // pose and bit 6 with option 0800, MISSING and bit 6 without
  OutOfVolumeMissing,  // MISSING and bit 6 with both
  Broken,              // MISSING and bit 8
};

struct CoilTruth {
  int port = 0, channel = 0;  // port from 1, channel from 0
  CoilState state = CoilState::Missing;
  Pose pose;                      // as reported; meaningless unless Valid or OutOfVolume
  std::int64_t pose_time_ns = 0;  // when `pose` was true: older than the measurement while poses are stuck
};

// One measurement with all coils that were enabled.
struct Truth {
  std::uint64_t measurement =
      0;  // counts all measurements; never repeats, unlike `frame` after a counter fault
  std::uint32_t frame = 0;
  std::int64_t time_ns = 0;
  std::vector<CoilTruth> coils;
};

struct Counts {
  std::uint64_t commands = 0, replies = 0, errors = 0, tracking_replies = 0, measurements = 0, resets = 0;
  std::array<std::uint64_t, kFaultKinds> struck{};
  std::uint64_t of(FaultKind kind) const { return struck[static_cast<std::size_t>(kind)]; }
};

}  // namespace tubed::second_aurora
