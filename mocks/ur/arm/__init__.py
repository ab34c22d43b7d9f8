"""The body of the mocked arm: kinematics, motions, rest, the force at its flange."""
