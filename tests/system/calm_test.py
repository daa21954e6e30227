"""calm.py: what is judged, what is run again, and what a witness sees."""
import os
import signal
import time
import unittest
import unittest.mock

import calm


class Told:
    """A witness that says what it is told to, one of `shares` after the other."""

    def __init__(self, shares):
        self.shares = list(shares)

    def __call__(self):
        return self

    def end(self):
        return calm.Withheld(self.shares.pop(0), 0)


def judged(codes, shares):
    """The code that stands, how often was run, and how often was waited."""
    left, waits = list(codes), []
    code = calm.judged_when_calm(lambda: left.pop(0), Told(shares), lambda: waits.append(1))
    return code, len(codes) - len(left), len(waits)


class JudgedWhenCalm(unittest.TestCase):
    BUSY = 2 * calm.TAKEN_AWAY

    def test_what_passes_or_skips_is_run_once(self):
        for code in (0, 77):
            self.assertEqual(judged([code], [self.BUSY]), (code, 1, 0))

    def test_a_failure_on_a_calm_machine_stands(self):
        self.assertEqual(judged([1, 0], [0.01, 0.01]), (1, 1, 0))

    def test_a_failure_on_a_busy_machine_is_run_again_when_it_is_calm(self):
        self.assertEqual(judged([1, 0], [self.BUSY, 0.01]), (0, 2, 1))
        self.assertEqual(judged([1, 1, 0], [self.BUSY, self.BUSY, 0.01]), (1, 2, 1))

    def test_the_last_failure_stands_however_busy_the_machine_is(self):
        self.assertEqual(judged([1, 1, 1, 0], [self.BUSY] * 4), (1, calm.ATTEMPTS, calm.ATTEMPTS - 1))

    def test_a_test_that_breaks_off_leaves_no_witness(self):
        witness = Told([0])
        with self.assertRaises(KeyboardInterrupt):
            calm.judged_when_calm(unittest.mock.Mock(side_effect=KeyboardInterrupt), witness)
        self.assertEqual(witness.shares, [], "nobody has ended it")


class Witness(unittest.TestCase):
    def test_tells_of_the_time_in_which_it_could_not_run(self):
        witness = calm.Witness()
        time.sleep(0.5)
        os.kill(witness.process.pid, signal.SIGSTOP)
        time.sleep(0.5)
        os.kill(witness.process.pid, signal.SIGCONT)
        time.sleep(0.2)
        withheld = witness.end()
        self.assertGreater(withheld.longest_ms, 300)
        self.assertGreater(withheld.share, calm.TAKEN_AWAY)


if __name__ == "__main__":
    unittest.main()
