// What a conversation says about measurements, the frame counter, and commands while the tracker tracks. Each
// function judges one assumption of drivers/aurora/README.md. Pure.
#pragma once

#include "clients/tubectl/check/aurora_judgement.hpp"

namespace tubed::judging {

Judgement first_reply_is_missing(const WireConversation& conversation);
Judgement bx_layout(const WireConversation& conversation);
Judgement tx_layout(const WireConversation& conversation);
Judgement lists_disabled_handles(const WireConversation& conversation);
Judgement min_turn(const WireConversation& conversation);
Judgement one_frame_a_reply(const WireConversation& conversation);
Judgement counts_by_8(const WireConversation& conversation);
Judgement forty_a_second(const WireConversation& conversation);
Judgement repeats_measurements(const WireConversation& conversation);
Judgement begins_soon(const WireConversation& conversation);
Judgement counter_goes_on(const WireConversation& conversation);
Judgement counter_goes_by_time(const WireConversation& conversation);
Judgement option_80_counts_anew(const WireConversation& conversation);
Judgement phsr_while_tracking(const WireConversation& conversation);
Judgement phinf_while_tracking(const WireConversation& conversation);
Judgement ver_and_comm_while_tracking(const WireConversation& conversation);
Judgement pinit_and_pdis_while_tracking(const WireConversation& conversation);
Judgement init_while_tracking(const WireConversation& conversation);
Judgement command_during_reply(const WireConversation& conversation);
Judgement pulled_plug(const WireConversation& conversation);
Judgement plug_put_in(const WireConversation& conversation);

}  // namespace tubed::judging
