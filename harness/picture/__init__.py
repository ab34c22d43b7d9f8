"""Pictures as light: pinhole, exposure, masks, and how far one picture is from another."""
