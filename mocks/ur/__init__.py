"""A mocked UR controller: real-time data exchange, dashboard and program ports, in simulated time.

``serve`` runs it; ``controller`` is all of it but the sockets. It executes the URScript that a
client uploads (``urscript``), so a client's commands are not imitated one by one.

Assumed where the manuals are silent: 0 as the number of a recipe that failed, ``runtime_state``
4 in a protective stop, the words of runtime errors, rest for 0.1 s as "steady", one radian of
turning counted as 0.1 m of a line's way, contact told by a force threshold. Not modelled: blends,
servoing, joint speeds, force mode, freedrive, dynamics (currents, torques, the mass matrix), a program
counter, analog and digital inputs, the binary state on ports 30001 to 30003 and 30011 (but for the messages
that a program began or ended), version 1 of the exchange.
"""
