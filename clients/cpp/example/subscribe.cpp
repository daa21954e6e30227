// Prints where the tip is and, as loudly, when that is not known any more.
#include <cstdio>
#include <cstdlib>

#include "clients/cpp/centreline.hpp"
#include "clients/cpp/tube_subscriber.hpp"

int main(int argc, char** argv) {
  tubed::TubeSubscriber subscriber({.domain = argc > 1 ? std::atoi(argv[1]) : 0});
  for (long left = argc > 2 ? std::atol(argv[2]) : -1; left != 0; --left) {
    const tubed::TubeNews news = subscriber.wait_for(std::chrono::seconds(1));
    if (news.event !=
        tubed::TubeEvent::kEstimate) {  // deadline missed, hung, gone, silent: hide the old shape
      std::printf("NO SHAPE: %s\n", tubed::name_of(news.event).data());
      continue;
    }
    if (news.sample->is_restart)
      std::puts("the daemon was restarted");  // backward numbers without one are dropped
    const tubed_TubeEstimate& tube = news.sample->estimate;
    const tubed::Vector3 tip = tubed::point_at(tube, 0);
    std::printf("%s %llu %s tip %.1f %.1f %.1f mm +- %.1f\n", tube.instrument_id,
                static_cast<unsigned long long>(tube.sequence_number),
                tube.validity == tubed_VALIDITY_VALID ? "VALID" : "NOT TO BE TRUSTED", tip[0], tip[1], tip[2],
                tubed::sigma_mm_at(tube, 0));
  }
}
