"""Ctrl-C during a simulation, at any time."""

import signal
import time

import numpy as np
import pytest

import esim


@pytest.fixture
def interrupt_after():
    """A function that has Ctrl-C pressed after some seconds."""
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def joined(packets):
    return np.concatenate([packet.events for packet in packets])


def test_ctrl_c_interrupts_and_leaves_a_simulation_that_goes_on(poster, interrupt_after):
    long = {"duration_s": 2.0, "camera.width": 320, "camera.height": 240}
    uninterrupted = joined(esim.simulate(poster, overrides=long))
    simulation = esim.simulate(poster, overrides=long, packet_s=10.0)
    interrupt_after(0.05)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        next(simulation)
    assert time.monotonic() - began < 5  # far less, but on a busy machine
    np.testing.assert_array_equal(joined(simulation), uninterrupted)


@pytest.mark.parametrize("after_s", [0.001, 0.002, 0.005])
def test_ctrl_c_shortly_before_a_packet_does_not_lose_it(poster, after_s, interrupt_after):
    short = {"camera.width": 80, "camera.height": 60}  # done before the simulation first looks for signals
    uninterrupted = joined(esim.simulate(poster, overrides=short))
    simulation = esim.simulate(poster, overrides=short, packet_s=10.0)
    packets = []
    interrupt_after(after_s)
    with pytest.raises(KeyboardInterrupt):
        packets.append(next(simulation))
        time.sleep(10)
    np.testing.assert_array_equal(joined([*packets, *simulation]), uninterrupted)


def test_ctrl_c_while_a_packet_is_made_does_not_lose_it(poster, monkeypatch):
    uninterrupted = joined(esim.simulate(poster))
    simulation = esim.simulate(poster, packet_s=10.0)

    def interrupted(*arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("esim._simulation._simulate.Packet", interrupted)
        with pytest.raises(KeyboardInterrupt):
            next(simulation)
    np.testing.assert_array_equal(joined(simulation), uninterrupted)
    assert simulation.report["status"] == "complete"


def test_ctrl_c_at_any_time_loses_no_packet(poster, interrupt_after):
    large = {"camera.width": 320, "camera.height": 240, "truth.rate_hz": 100.0}  # copied to Python for milliseconds
    uninterrupted = joined(esim.simulate(poster, overrides=large))
    for delay in np.linspace(0.01, 0.2, 20):
        simulation = esim.simulate(poster, overrides=large, packet_s=10.0)
        packets = []
        interrupt_after(delay)
        with pytest.raises(KeyboardInterrupt):
            packets.append(next(simulation))
            time.sleep(10)
        np.testing.assert_array_equal(joined([*packets, *simulation]), uninterrupted)
