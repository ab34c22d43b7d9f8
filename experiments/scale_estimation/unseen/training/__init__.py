"""How the networks of objects never drawn are trained; torch is needed for nothing else here."""
