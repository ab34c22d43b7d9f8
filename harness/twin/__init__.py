"""The bench as a MuJoCo model: kinematics, collisions and the rehearsal of a run."""
