"""Size by sound: which factor lays the heard frequencies on those of the model."""
